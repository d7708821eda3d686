"""``cospeech synthesize``: motion for speech that is in no corpus."""

from __future__ import annotations

import argparse
import math
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from cospeech.commands import synthesize_head
from cospeech.commands.keywords import read_keywords
from cospeech.commands.messages import note, note_compilation
from cospeech.commands.parser import add_channel, whole_number
from cospeech.errors import UserError

if TYPE_CHECKING:
    import pandas as pd

    from cospeech.api import ActorModel, HeadModel, Performance
    from cospeech.commands.parser import Parser

FORMATS = {
    "bvh": (".bvh", "motion for animation programs"),
    "table": (".motion.parquet", "motion table: joint angles in degrees"),
    "mp4": (".mp4", "video of the moving body, with the sound"),
    "textgrid": (".TextGrid", "gesture phrases for Praat"),
}
"""The formats that can be written: the end of the file's name, and what it contains."""

HEAD_FORMATS = synthesize_head.FORMATS
"""The same for models that move the head alone."""

DESCRIPTION = """\
Synthesize gestures for speech.

Each sound file becomes motion that is exactly as long as the sound. Any format
that FFmpeg decodes is read, and the sound of videos. The same file gives the
same bytes every time; some systems, such as that of the bundled model, make
other gestures with another --seed."""

EPILOG = (
    "formats:\n"
    + "\n".join(f"  {name:<10}{end:<17}{what}" for name, (end, what) in FORMATS.items())
    + "\n\nformats of models that move the head alone:\n"
    + "\n".join(f"  {name:<10}{end:<17}{what}" for name, (end, what) in HEAD_FORMATS.items())
    + """

examples:
  cospeech synthesize speech.wav
  cospeech synthesize *.wav --out motion/ --format bvh
  cospeech synthesize interview.mp4 --channel 2 --seed 1
  cospeech synthesize speech.wav --words speech.TextGrid \\
    --keywords words.csv --model results/mine/models/controller/main/ada
  cospeech synthesize speech.wav \\
    --model results/mine/models/hsmm_weighted/clusters~8,states~3/ada

'cospeech run models --config mine.yaml' trains models on your own corpus, in
results/<run>/models/<system>/<variant>/<actor>."""
)

MOST_VIDEO_FPS, VIDEO_HEIGHT_PX = 30.0, 540

TERMINATED = 143
"""Exit status after SIGTERM, as shells define it."""


def add(commands: argparse._SubParsersAction[Parser]) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "synthesize",
        usage="cospeech synthesize FILE ... [options]",
        help="synthesize gestures for sound files",
        description=DESCRIPTION,
        epilog=EPILOG,
    )
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="sound files with speech")
    parser.add_argument(
        "--model",
        type=Path,
        metavar="FOLDER",
        help="folder of a trained model (default: the bundled model of a virtual actor)",
    )
    parser.add_argument(
        "--out", type=Path, default=Path(), metavar="FOLDER", help="where to write (default: the current folder)"
    )
    parser.add_argument(
        "--format",
        type=_formats,
        action="extend",
        metavar="FORMAT[,...]",
        help=f"what to write: {', '.join(FORMATS)} (default: all of them); see below for heads",
    )
    parser.add_argument(
        "--seed", type=whole_number(0), metavar="N", help="seed of random draws (default: that of the model)"
    )
    add_channel(parser)
    parser.add_argument(
        "--body",
        type=Path,
        metavar="TABLE",
        help="motion table to take from what the model does not move (default: it stands still)",
    )
    parser.add_argument(
        "--words",
        type=Path,
        metavar="FILE",
        help="words of the speech with their times: a TextGrid with a tier 'words', or a CSV file with the columns "
        "start_s, end_s and word; each keyword of the model calls for its gestures",
    )
    parser.add_argument(
        "--keywords",
        type=Path,
        metavar="FILE",
        help="gestures of a gesture controller that keywords call for: a CSV file with the columns word and segment "
        "(default: those of the model)",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace existing files")
    parser.set_defaults(execute=run, error=parser.error)


def _formats(text: str) -> list[str]:
    names = text.split(",")
    for name in names:
        if name not in FORMATS | HEAD_FORMATS:
            known = ", ".join(FORMATS | HEAD_FORMATS)
            raise argparse.ArgumentTypeError(f"unknown format '{name}'; known are {known}")
    return names


def run(arguments: argparse.Namespace) -> int:
    """Synthesize every file, and return 1 if this failed for one of them."""
    twice = [stem for stem, count in Counter(path.stem for path in arguments.files).items() if count > 1]
    if twice:
        arguments.error(f"two files are called '{twice[0]}', and so would their results; give them to two calls")
    if arguments.words is not None and len(arguments.files) > 1:
        arguments.error("--words: are those of one sound file; give each file to a call of its own")
    if arguments.keywords is not None and arguments.words is None:
        arguments.error("--keywords: needs --words, a file with the times of the words of the speech")
    note_compilation()
    from cospeech import api  # not above: it loads pandas and the compiled kernels
    from cospeech.data import tables

    nods = arguments.model is not None and api.system_of_model(arguments.model).makes == "head"
    known = HEAD_FORMATS if nods else FORMATS
    formats = list(dict.fromkeys(arguments.format or known))
    for name in formats:
        if name not in known:
            moves = "the head alone" if nods else "a body"
            arguments.error(f"--format {name}: this model moves {moves}; it can write {', '.join(known)}")
    model = api.load_head_model(arguments.model) if nods else api.load_model(arguments.model)
    if arguments.words is not None and isinstance(model, api.HeadModel):
        arguments.error("--words: this model moves the head alone, and has no keywords")
    if arguments.keywords is not None and isinstance(model, api.ActorModel):
        model = api.with_keywords(model, read_keywords(arguments.keywords))
    body = None if arguments.body is None else tables.read(arguments.body, "motion")
    failed = False
    with output_folder(arguments.out):
        if arguments.model is None:
            note("using the bundled model, which was learned from a virtual actor and not from people")
        for path in arguments.files:
            try:
                targets = {name: arguments.out / f"{path.stem}{known[name][0]}" for name in formats}
                check_free(targets, arguments.overwrite)
                synthesize(path, model, targets, arguments, body)
            except UserError as error:
                failed = True
                note(str(error))
    return int(failed)


@contextmanager
def output_folder(folder: Path) -> Iterator[None]:
    """Make the output folder. At the end, remove what was made and is still empty, as all files may be wrong.

    Raises
    ------
    UserError : if files cannot be written to the folder.
    """
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise UserError(f"{folder}: not a writable folder ({error.strerror}); name another with --out") from error
    try:
        yield
    finally:
        with suppress(OSError):  # it contains results
            for path in made:
                path.rmdir()


def check_free(targets: dict[str, Path], overwrite: bool) -> None:
    """Raise UserError if a file is in the way."""
    for path in targets.values():
        if path.is_dir():
            raise UserError(f"{path}: is a folder; move it away, or name another folder with --out")
        if path.exists() and not overwrite:
            raise UserError(f"{path}: already exists; replace it with --overwrite, or name another folder with --out")


def synthesize(
    path: Path,
    model: ActorModel | HeadModel,
    targets: dict[str, Path],
    arguments: argparse.Namespace,
    body: pd.DataFrame | None,
) -> None:
    """Synthesize one file; the results appear together, once all of them are complete."""
    from cospeech import api
    from cospeech.corpus import words
    from cospeech.formats import audio

    spoken = None if arguments.words is None else words.read(arguments.words, path.stem)
    sound = audio.read(path, arguments.channel)
    for remark in sound.notes:
        note(f"{path}: {remark}")
    made: Any
    try:
        if isinstance(model, api.HeadModel):
            made = synthesize_head.made(sound.samples, model, path.stem, arguments.seed, body)
        else:
            made = api.synthesize(
                sound.samples, model, record=path.stem, seed=arguments.seed, body=body, words=spoken
            )
    except UserError as error:
        raise UserError(f"{path}: {error}") from error
    writer: Any = synthesize_head.write if isinstance(model, api.HeadModel) else write
    folder = next(iter(targets.values())).parent
    try:
        with temporary_folder(folder, path.stem) as temporary:
            parts = {name: temporary / target.name for name, target in targets.items()}
            for name, part in parts.items():
                writer(name, part, made, model, path.stem)
            for name, part in parts.items():
                part.replace(targets[name])
    except OSError as error:
        raise UserError(f"{path}: its results cannot be written to {folder} ({error.strerror})") from error
    for target in targets.values():
        print(target, flush=True)


@contextmanager
def temporary_folder(parent: Path, stem: str) -> Iterator[Path]:
    """Give a folder that is removed at the end, after SIGTERM too."""

    def stop(*_: object) -> NoReturn:
        sys.exit(TERMINATED)

    before = signal.signal(signal.SIGTERM, stop)
    try:
        with tempfile.TemporaryDirectory(prefix=f".{stem[:100]}-", dir=parent) as folder:
            yield Path(folder)
    finally:
        signal.signal(signal.SIGTERM, before)


def write(name: str, path: Path, made: Performance, model: ActorModel, record: str) -> None:
    """Write what was synthesized in one format."""
    card = model.card
    if name == "bvh":
        from cospeech.formats import bvh

        bvh.write(made.motion, path)
    elif name == "table":
        from cospeech.data import tables
        from cospeech.workflow.job import settings_hash

        tables.write(made.motion, path, "motion", corpus=card["corpus"], config_hash=settings_hash(dict(card)))
    elif name == "textgrid":
        from cospeech.formats import sound, textgrid

        duration_s = len(made.sound) / sound.RATE_HZ
        starts, labels = made.phrases["start_s"].tolist(), made.phrases["label"].tolist()
        # The last phrase ends with the last whole frame of prosody, and the tier with the sound.
        textgrid.write(path, "gesture", list(zip(starts, [*starts[1:], duration_s], labels, strict=True)), duration_s)
    else:
        from cospeech.formats import sound
        from cospeech.motion import skeleton
        from cospeech.rendering import video

        wav = path.with_suffix(".wav")
        sound.write(made.sound, wav)
        fps = skeleton.frame_rate(made.motion)
        fps /= math.ceil(fps / MOST_VIDEO_FPS)  # each picture shows a frame of the motion, and none is shown twice
        panel = video.Panel(model.system.title, made.motion, made.phrases)
        caption = f"{record} · model of {card['actor']} ({card['corpus']})"
        video.write_video(path, [panel], caption, fps, VIDEO_HEIGHT_PX, longest_s=None, sound=wav)

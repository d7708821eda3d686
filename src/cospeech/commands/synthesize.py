"""``cospeech synthesize``: motion for speech that is in no corpus."""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from cospeech.errors import UserError

if TYPE_CHECKING:
    from cospeech.api import ActorModel, Performance
    from cospeech.commands.parser import Parser

FORMATS = {
    "bvh": (".bvh", "motion for animation programs"),
    "table": (".motion.parquet", "motion table: joint angles in degrees"),
    "mp4": (".mp4", "video of the moving body, with the sound"),
    "textgrid": (".TextGrid", "gesture phrases for Praat"),
}
"""The formats that can be written: the end of the file's name, and what it holds."""

DESCRIPTION = """\
Synthesize gestures for speech.

Each sound file becomes motion that is exactly as long as the sound. The same
file, model and seed give the same bytes. Any format that FFmpeg decodes is
read, the sound of a video as well."""

EPILOG = (
    "formats:\n"
    + "\n".join(f"  {name:<10}{end:<17}{what}" for name, (end, what) in FORMATS.items())
    + """

examples:
  cospeech synthesize speech.wav
  cospeech synthesize *.wav --out motion/ --format bvh
  cospeech synthesize interview.mp4 --channel 2 --model results/mine/models/hsmm_weighted/clusters~8,states~3/ada

'cospeech run models --config mine.yaml' trains the models of your own corpus in
results/<run>/models/<system>/<variant>/<actor>."""
)

VIDEO_FPS, VIDEO_HEIGHT_PX = 20.0, 360


def add(commands: argparse._SubParsersAction[Parser]) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "synthesize", help="synthesize gestures for a sound file", description=DESCRIPTION, epilog=EPILOG
    )
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="sound files with speech")
    parser.add_argument(
        "--model", type=Path, metavar="FOLDER", help="folder of a trained model (default: a small bundled one)"
    )
    parser.add_argument(
        "--out", type=Path, default=Path(), metavar="FOLDER", help="where to write (default: the current folder)"
    )
    parser.add_argument(
        "--format",
        type=_formats,
        action="extend",
        metavar="FORMAT[,...]",
        help=f"what to write: {', '.join(FORMATS)} (default: all)",
    )
    parser.add_argument("--seed", type=_seed, metavar="N", help="seed of random draws (default: the model's)")
    parser.add_argument(
        "--channel", type=_channel, metavar="N", help="channel to listen to, from 1 (default: all channels, mixed)"
    )
    parser.add_argument(
        "--body",
        type=Path,
        metavar="TABLE",
        help="motion table to take hips, spine, head and legs from (default: they stand still)",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist")
    parser.set_defaults(execute=run)


def _formats(text: str) -> list[str]:
    names = text.split(",")
    for name in names:
        if name not in FORMATS:
            raise argparse.ArgumentTypeError(f"unknown format '{name}'; known are {', '.join(FORMATS)}")
    return names


def _seed(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 0")
    return int(text)


def _channel(text: str) -> int:
    if not (text.isdecimal() and int(text) > 0):
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 1")
    return int(text)


def run(arguments: argparse.Namespace) -> int:
    """Synthesize every file, and return 1 if one of them could not be."""
    twice = [stem for stem, count in Counter(path.stem for path in arguments.files).items() if count > 1]
    if twice:
        raise UserError(f"two files are called '{twice[0]}', and their results would be too; give them to two calls")
    formats = list(dict.fromkeys(arguments.format or FORMATS))
    check_writable(arguments.out)
    from cospeech import api  # not above: it loads pandas and the compiled kernels

    model = api.load_model(arguments.model)
    card = model.card
    if arguments.model is None:
        print(
            f"cospeech: no --model given: the bundled model of a virtual actor ('{card['actor']}'); "
            "it was not learned from people",
            file=sys.stderr,
        )
    print(f"cospeech: {card['system']}, {card['variant']}, of {card['actor']} ({card['corpus']})", file=sys.stderr)
    failed = False
    for path in arguments.files:
        try:
            targets = {name: arguments.out / f"{path.stem}{FORMATS[name][0]}" for name in formats}
            check_free(targets, arguments.overwrite)
            synthesize(path, model, targets, arguments)
        except UserError as error:
            failed = True
            print(f"cospeech: {error}", file=sys.stderr)
    return int(failed)


def check_writable(folder: Path) -> None:
    """Make the output folder, and raise UserError where files cannot be written to it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise UserError(
            f"{folder}: cannot be written to ({error.strerror}); name another folder with --out"
        ) from error


def check_free(targets: dict[str, Path], overwrite: bool) -> None:
    """Raise UserError where a file is in the way."""
    for path in targets.values():
        if path.is_dir() or (path.exists() and not overwrite):
            hint = "move it away" if path.is_dir() else "give --overwrite to replace it"
            raise UserError(f"{path}: already exists; {hint}, or name another folder with --out")


def synthesize(path: Path, model: ActorModel, targets: dict[str, Path], arguments: argparse.Namespace) -> None:
    """Synthesize one file; its results appear together, once all of them are whole."""
    from cospeech import api
    from cospeech.data import tables
    from cospeech.formats import audio

    sound = audio.read(path, arguments.channel)
    for note in sound.notes:
        print(f"cospeech: {path}: {note}", file=sys.stderr)
    body = None if arguments.body is None else tables.read(arguments.body, "motion")
    made = api.synthesize(sound, model, record=path.stem, seed=arguments.seed, body=body)
    folder = next(iter(targets.values())).parent
    try:
        with tempfile.TemporaryDirectory(prefix=f".{path.stem}-", dir=folder) as temporary:
            parts = {name: Path(temporary, target.name) for name, target in targets.items()}
            for name, part in parts.items():
                write(name, part, made, model, Path(temporary))
            for name, part in parts.items():
                shutil.move(part, targets[name])
    except OSError as error:
        raise UserError(f"{path}: its results cannot be written ({error.strerror}); nothing was kept") from error
    for target in targets.values():
        print(target)


def write(name: str, path: Path, made: Performance, model: ActorModel, folder: Path) -> None:
    """Write a performance in one format."""
    card = model.card
    record, duration_s = made.decoding["record"].iloc[0], len(made.sound) / 16000
    if name == "bvh":
        from cospeech.formats import bvh

        bvh.write(made.motion, path)
    elif name == "table":
        from cospeech.data import tables
        from cospeech.workflow.job import settings_hash

        tables.write(made.motion, path, "motion", corpus=card["corpus"], config_hash=settings_hash(dict(card)))
    elif name == "textgrid":
        from cospeech.formats import textgrid

        phrases = made.phrases
        ends = phrases["end_s"].clip(upper=duration_s).tolist()
        spans = list(
            zip(phrases["start_s"].tolist(), [*ends[:-1], duration_s], phrases["label"].tolist(), strict=True)
        )
        textgrid.write(path, "gesture", spans if len(phrases) else [], duration_s)
    else:
        from cospeech.formats import sound
        from cospeech.rendering import video

        wav = folder / "sound.wav"
        sound.write(made.sound, wav)
        caption = f"{record} · {card['corpus']}"
        panel = video.Panel(card["system"], made.motion, made.phrases)
        video.write_video(path, [panel], caption, VIDEO_FPS, VIDEO_HEIGHT_PX, longest_s=None, sound=wav)

"""``cospeech library``: a gesture controller with another motion library, from any folder of motion files."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from cospeech.commands.keywords import read_keywords
from cospeech.commands.synthesize import note
from cospeech.errors import UserError

if TYPE_CHECKING:
    import pandas as pd

    from cospeech.api import ActorModel
    from cospeech.commands.parser import Parser
    from cospeech.corpus.any_body import Folder

SYSTEM = "controller"

DESCRIPTION = """\
Build a gesture controller from motion files.

The new controller listens as that of --model does, which has learned from
speech and motion; what it shows are segments of the motion in MOTIONS, a folder
of BVH or GLB files, which need no speech. Any body will do, human or not, if
all files are of the same one. Without MOTIONS, it keeps the motion that it has,
which is useful to give it --keywords.

Gestures are movements of the hands. On bodies other than that of cospeech, the
end effectors that move fastest are taken for hands, unless --hands names them,
and the body's own slow and fast movements stand for those of a person."""

EPILOG = """\
examples:
  cospeech library phone/ --model results/demo/models/controller/main/ada \\
    --out phone_controller
  cospeech library octopus/ --model ... --out octopus --unit cm \\
    --hands tentacle_1,tentacle_2
  cospeech library --model ... --keywords words.csv --out with_words

keywords:
  A CSV file with the columns word and segment, one row per gesture that fits
  the word. Segments are numbered in the table library.parquet of the model.

'cospeech live --model FOLDER' runs the new controller."""


def add(commands: argparse._SubParsersAction[Parser]) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "library",
        usage="cospeech library [MOTIONS] --model FOLDER --out FOLDER [options]",
        help="build a gesture controller from a folder of motion files",
        description=DESCRIPTION,
        epilog=EPILOG,
    )
    parser.add_argument("motions", nargs="?", type=Path, metavar="MOTIONS", help="folder of BVH or GLB files")
    parser.add_argument("--model", type=Path, required=True, metavar="FOLDER", help="a trained gesture controller")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="folder of the new controller")
    parser.add_argument(
        "--hands",
        type=_names,
        default=(),
        metavar="A[,B...]",
        help="joints that gesture (default: those that move most)",
    )
    parser.add_argument("--keywords", type=Path, metavar="FILE", help="CSV file with the columns word and segment")
    parser.add_argument("--unit", choices=("m", "cm", "mm", "in"), default="m", help="unit of BVH files (default: m)")
    parser.add_argument("--up", choices=("y", "z"), default="y", help="axis of BVH files that points up (default: y)")
    parser.set_defaults(execute=run)


def _names(text: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(","))
    if not all(names):
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of joints separated by commas")
    return names


def run(arguments: argparse.Namespace) -> int:
    """Build the controller."""
    if arguments.motions is None and arguments.keywords is None:
        raise UserError("nothing to build: name a folder of motion files, or keywords with --keywords")
    if arguments.hands and arguments.motions is None:
        raise UserError("--hands: names joints of motion files, but no folder of these is given")
    if arguments.out.exists() and (not arguments.out.is_dir() or any(arguments.out.iterdir())):
        raise UserError(f"{arguments.out}: already exists; name a new folder with --out")
    from cospeech import api
    from cospeech.synthesis.controller import model as controller

    model = api.load_model(arguments.model)
    if model.system.model != SYSTEM:
        raise UserError(f"{arguments.model}: is a model of '{model.system.name}'; give one of a gesture controller")
    keywords = {} if arguments.keywords is None else read_keywords(arguments.keywords)
    folder, segments = None, None
    if arguments.motions is not None:
        folder, segments = api.motion_library(
            arguments.motions, unit=arguments.unit, up=arguments.up, hands=arguments.hands
        )
        for line in folder.notes:
            note(line)
    made = controller.with_library(model.trained.model, segments, keywords)
    write(arguments.out, model, made, folder)
    library = made.control.library
    seconds = len(library.poses.root_m) / library.fps
    hands = f", hands: {', '.join(folder.hands)}" if folder else ""
    note(f"{len(library.table)} segments of {len(library.first)} recordings, {seconds:.0f} s{hands}")
    print(arguments.out, flush=True)
    return 0


def write(out: Path, model: ActorModel, made: object, folder: Folder | None) -> None:
    """Write the new controller as a model folder."""
    from cospeech import __version__
    from cospeech.data import tables
    from cospeech.markov import labelled_hmm
    from cospeech.motion import library
    from cospeech.motion.body import STANDARD
    from cospeech.workflow import model_folder
    from cospeech.workflow.job import settings_hash

    own = model.trained.method.to_tables(made)
    named = {name: (own[name], schema) for name, schema in model.system.table_schemas.items()}
    motions: dict[str, pd.DataFrame] = dict(model.motions)
    gestures = model.gestures
    card = dict(model.card) | {"version": __version__, "held_out": None}
    if folder is not None:
        standard = folder.body is STANDARD
        motions = (
            {name: library.to_motion(poses, folder.fps) for name, poses in folder.recordings.items()}
            if standard
            else {}
        )
        gestures = tables.empty("segments")
        card |= {"records": list(folder.recordings), "motion_fps": folder.fps}
    named |= {f"motion~{name}": (motion, "motion") for name, motion in motions.items()}
    named["gestures"] = (gestures, "segments")
    named["gesture_model"] = (labelled_hmm.to_table(model.gesture_model), "hmm_model")
    named["prosody_model"] = (labelled_hmm.to_table(model.prosody_model), "hmm_model")
    corpus = str(card.pop("corpus"))
    for entry in ("format", "tables", "sha256"):
        card.pop(entry, None)
    model_folder.write(out, card, named, corpus=corpus, config_hash=settings_hash(card))

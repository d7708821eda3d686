"""``cospeech identity``: enrol speakers by their voice and lips, and say who speaks in a film."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from cospeech.commands.messages import note
from cospeech.errors import UserError

if TYPE_CHECKING:
    from cospeech.commands.parser import Parser

DESCRIPTION = """\
Say who speaks in a film, by voice and lips, or that it is nobody known.

Everybody says a phrase of their own, such as their name. 'enrol' learns the
speakers of a sheet, 'identify' compares a film with them."""

ENROL = """\
Learn speakers from films of their faces with sound.

SHEET is a CSV file with the columns file, speaker, phrase and session. Each
speaker needs two films of the own phrase or more, which is the first one that
is listed for this speaker; films of other phrases are those of impostors, from
which the threshold is set. Optional columns are sound (a sound file, if the
film has none), own_name (yes or no), mouth_x_px and mouth_y_px (the centre of
the mouth in the first frame, if it is not found automatically)."""

IDENTIFY = """\
Say who speaks in films, one line for each: the speaker or 'nobody known', the
score, and the threshold at the chosen false-accept rate."""

EPILOG = """\
examples:
  cospeech identity enrol clips.csv --out speakers/
  cospeech identity identify door.mp4 --model speakers/
  cospeech identity identify door.mp4 --model speakers/ --false-accept 5"""

REGULARISATION = 0.1
"""Of the canonical correlation analysis: a few speakers have too few frames for a well-conditioned covariance."""


def add(commands: argparse._SubParsersAction[Parser]) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "identity",
        usage="cospeech identity {enrol,identify} ...",
        help="say who speaks in a film, by voice and lips",
        description=DESCRIPTION,
        epilog=EPILOG,
    )
    actions = parser.add_subparsers(title="actions", metavar="ACTION", required=True)
    one = actions.add_parser(
        "enrol",
        usage="cospeech identity enrol SHEET --out FOLDER",
        help="learn speakers from a sheet of films",
        description=ENROL,
        epilog=EPILOG,
    )
    one.add_argument("sheet", type=Path, metavar="SHEET", help="CSV file that lists films")
    one.add_argument("--out", type=Path, required=True, metavar="FOLDER", help="folder of the model, a new one")
    one.set_defaults(execute=enrol)
    two = actions.add_parser(
        "identify",
        usage="cospeech identity identify FILM ... --model FOLDER [--false-accept PERCENT] [--mouth X,Y]",
        help="say who speaks in a film",
        description=IDENTIFY,
        epilog=EPILOG,
    )
    two.add_argument("films", type=Path, nargs="+", metavar="FILM", help="films of a speaking face, with sound")
    two.add_argument("--model", type=Path, required=True, metavar="FOLDER", help="folder that 'enrol' has written")
    two.add_argument(
        "--false-accept",
        type=percentage,
        default=0.05,
        metavar="PERCENT",
        help="share of impostors that may be accepted (default: 5)",
    )
    two.add_argument("--mouth", type=place, metavar="X,Y", help="centre of the mouth in the first frame, in pixels")
    two.set_defaults(execute=identify)


def percentage(text: str) -> float:
    """Return the share that an argument gives in percent."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < 100.0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a percentage between 0 and 100")
    return value / 100.0


def place(text: str) -> tuple[float, float]:
    """Return the place that an argument gives as ``X,Y``."""
    try:
        x, y = map(float, text.split(","))
    except ValueError:
        x = y = math.nan
    if not (math.isfinite(x) and math.isfinite(y)):
        raise argparse.ArgumentTypeError(f"'{text}' is not a place; write X,Y in pixels")
    return x, y


def enrol(arguments: argparse.Namespace) -> int:
    """Learn the speakers of a sheet."""
    out: Path = arguments.out
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise UserError(f"{out}: already exists; name a new folder with --out")
    from cospeech.commands import clips
    from cospeech.data import tables
    from cospeech.identity import classifiers, delay, enrolment, verification

    given = clips.of_sheet(arguments.sheet)
    for line in verification.lacking(given.clips):
        note(line)
    found = delay.find(given, delay.Settings(), seed=0)
    shift = 0 if found.doubt else round(found.delay_s * 100)
    model = enrolment.enrol(given, shift, classifiers.Settings(), REGULARISATION)
    for schema, table in enrolment.to_tables(model).items():
        tables.write(table, out / f"{schema}.parquet", schema, corpus=arguments.sheet.stem, config_hash="none")
    note(f"{len(model.speakers)} speakers: {', '.join(model.speakers)}")
    note(f"voice and lips: {found.doubt or f'the voice lags {1000 * found.delay_s:.0f} ms behind the lips'}")
    print(out, flush=True)
    return 0


def identify(arguments: argparse.Namespace) -> int:
    """Say who speaks in films."""
    from cospeech.commands import clips
    from cospeech.data import tables
    from cospeech.identity import enrolment

    folder: Path = arguments.model
    paths = {name: folder / f"{name}.parquet" for name in enrolment.TABLES}
    missing = [path.name for path in paths.values() if not path.is_file()]
    if missing:
        raise UserError(
            f"{folder}: contains no {missing[0]}; name a folder that 'cospeech identity enrol' has written"
        )
    model = enrolment.from_tables({name: tables.read(path, name) for name, path in paths.items()})
    at_least = enrolment.threshold(model, arguments.false_accept)
    given = clips.of_films(arguments.films, arguments.mouth)
    for film, one in zip(arguments.films, enrolment.identify(model, given, at_least), strict=True):
        who = one.speaker if one.accepted else f"nobody known (nearest: {one.speaker})"
        print(
            f"{film}: {who}; score {one.score:.1f}, threshold {at_least:.1f} at a false-accept rate of "
            f"{100 * arguments.false_accept:g} %",
            flush=True,
        )
    return 0

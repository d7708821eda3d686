"""``cospeech sync``: how far sound and lips of a film are apart."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from cospeech.commands.identity import place
from cospeech.errors import UserError

if TYPE_CHECKING:
    from cospeech.commands.parser import Parser

DESCRIPTION = """\
Say how far the sound and the lips of films are apart, with the uncertainty.

A face must be seen speaking for twenty seconds or more. On virtual faces, twenty
seconds give the delay to 10 ms, and ten seconds suffice in three films of four.
A positive delay means that the sound comes late. The answer is that it cannot be
told if nobody speaks, if the lips do not move, if the lips fit any other part
of the sound as well, or if the interval is wider than 0.1 s."""

EPILOG = """\
examples:
  cospeech sync interview.mp4
  cospeech sync *.mp4 --longest 0.5"""


def add(commands: argparse._SubParsersAction[Parser]) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "sync",
        usage="cospeech sync FILM ... [--longest SECONDS] [--mouth X,Y]",
        help="say how far sound and lips of a film are apart",
        description=DESCRIPTION,
        epilog=EPILOG,
    )
    parser.add_argument("films", type=Path, nargs="+", metavar="FILM", help="films of a speaking face, with sound")
    parser.add_argument(
        "--longest", type=longest, default=0.25, metavar="SECONDS", help="longest delay to try (default: 0.25)"
    )
    parser.add_argument(
        "--mouth", type=place, metavar="X,Y", help="centre of the mouth in the first frame, in pixels"
    )
    parser.set_defaults(execute=run)


def longest(text: str) -> float:
    """Return the longest delay that an argument gives in seconds."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.05 <= value <= 2.0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of seconds from 0.05 to 2")
    return value


def run(arguments: argparse.Namespace) -> int:
    """Say how far sound and lips are apart."""
    from cospeech.commands import clips
    from cospeech.identity import delay

    settings = delay.Settings(longest_s=arguments.longest)
    for film in arguments.films:
        if not film.is_file():
            raise UserError(f"{film}: no such file; correct the path")
    for film in arguments.films:
        try:
            found = delay.find(clips.of_films([film], arguments.mouth), settings, seed=0)
        except UserError as error:
            print(f"{film}: cannot be told: {str(error).removeprefix(f'{film}: ')}", flush=True)
            continue
        low, high = 1000 * found.low_s, 1000 * found.high_s
        said = (
            f"cannot be told: {found.doubt}"
            if found.doubt
            else f"the sound comes {abs(1000 * found.delay_s):.0f} ms {'late' if found.delay_s >= 0 else 'early'} "
            f"(delay {1000 * found.delay_s:+.0f} ms, 95 % interval {low:+.0f} to {high:+.0f} ms)"
        )
        print(f"{film}: {said}", flush=True)
    return 0

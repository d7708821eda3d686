"""The argument parser that all commands share, and the types of their arguments."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import Any


class Parser(argparse.ArgumentParser):
    """An argument parser that prints descriptions and examples as written and accepts no abbreviated options.

    Parameters
    ----------
    prog : name of the command.
    forwarded : name of the attribute that takes the arguments after ``--``, which belong to another program; without
        it, what follows ``--`` are positional arguments as usual.
    **settings : as for ``argparse.ArgumentParser``.
    """

    def __init__(self, prog: str, forwarded: str | None = None, **settings: Any) -> None:
        super().__init__(prog, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False, **settings)
        self.forwarded = forwarded

    def parse_known_args(  # type: ignore[override]  # the overloads of the base class differ in the namespace only
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Parse the arguments up to ``--``, if those after it are forwarded; an unknown one is an error."""
        own, rest = list(args or ()), []
        if self.forwarded and "--" in own:
            cut = own.index("--")
            own, rest = own[:cut], own[cut + 1 :]
        parsed, unknown = super().parse_known_args(own, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        if self.forwarded:
            setattr(parsed, self.forwarded, rest)
        return parsed, unknown


def whole_number(least: int) -> Callable[[str], int]:
    """Return the type of an argument that is a whole number, ``least`` or greater."""

    def number(text: str) -> int:
        if not (text.isascii() and text.isdecimal() and int(text) >= least):
            raise argparse.ArgumentTypeError(f"'{text}' is not a whole number, {least} or greater")
        return int(text)

    return number


def add_channel(parser: argparse.ArgumentParser) -> None:
    """Declare the option that chooses a channel of the sound."""
    parser.add_argument(
        "--channel",
        type=whole_number(1),
        metavar="N",
        help="channel of the sound to use, counted from 1 (default: all, mixed down to one)",
    )

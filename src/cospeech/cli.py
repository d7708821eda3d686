"""The command ``cospeech``.

Each module of ``cospeech.commands`` declares its commands in a function ``add``, and sets ``execute`` to the function
that carries them out: it takes the parsed arguments and returns the exit status. All of these modules are imported at
every start, even for ``--help``; they import whatever is slow (pandas, numba, Snakemake) inside that function.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import cospeech
from cospeech.commands import convert, identity, library, live, retarget, sync, synthesize, view, workflow
from cospeech.commands.parser import Parser
from cospeech.errors import UserError

COMMANDS = (synthesize, live, library, view, convert, retarget, identity, sync, workflow)

DESCRIPTION = "Learn which gestures go with which prosody, and synthesize gestures for speech."

EXAMPLES = """\
examples:
  cospeech synthesize speech.wav        gestures for your own speech, as BVH and
                                        as video
  cospeech view walk.bvh speech.wav     watch them in 3D
  cospeech live --microphone            gestures while you speak, for an avatar
  cospeech report                       run the demo and write its report
  cospeech report --config mine.yaml    the same for your own corpus
  cospeech report --help                show the options of a command

exit status:
  0 if all went well, 1 if the input is wrong or a job failed, 2 if the command
  line is wrong, 130 after Ctrl-C"""

INTERRUPTED = 130
"""Exit status after Ctrl-C, as shells define it: 128 + SIGINT."""


def parser() -> Parser:
    """Return the parser of the whole command line."""
    top = Parser("cospeech", description=DESCRIPTION, epilog=EXAMPLES)
    top.add_argument("-V", "--version", action="version", version=f"cospeech {cospeech.__version__}")
    commands = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for module in COMMANDS:
        module.add(commands)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Carry out the command that ``arguments`` (default: the command line) ask for, and return the exit status."""
    parsed = parser().parse_args(sys.argv[1:] if arguments is None else arguments)
    try:
        status: int = parsed.execute(parsed)
    except UserError as error:
        print(f"cospeech: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("cospeech: interrupted", file=sys.stderr)
        return INTERRUPTED
    return status

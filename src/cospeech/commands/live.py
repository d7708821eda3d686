"""``cospeech live``: motion for speech while it is spoken."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from cospeech.commands.messages import note, note_compilation
from cospeech.commands.parser import add_channel, whole_number
from cospeech.errors import UserError

if TYPE_CHECKING:
    from cospeech.api import ActorModel, HeadModel
    from cospeech.commands.parser import Parser
    from cospeech.live.changes import Listener
    from cospeech.live.engine import Engine
    from cospeech.live.outputs import Output
    from cospeech.live.sound import Source
    from cospeech.synthesis.live import Controls

PCM = "16000:s16le"
VMC = "127.0.0.1:39539"
THIS_MACHINE = "127.0.0.1"

DESCRIPTION = """\
Gesture while somebody speaks.

Sound comes from a pipe, from a microphone, or from a file that is heard in real
time. Motion goes to an avatar by the VMC protocol, and to files. Ctrl-C stops
and completes the files."""

EPILOG = """\
sound on standard input:
  --pcm RATE:FORMAT:CHANNELS describes it; format and channels may be left out.
  Formats are u8, s16le, s16be, s32le, s32be, f32le, f32be, f64le and f64be.

examples:
  arecord -q -t raw -r 16000 -f S16_LE | cospeech live --model MODEL
  ffmpeg -v error -i URL -f s16le -ar 16000 -ac 1 - | cospeech live
  cospeech live --model MODEL --microphone --record session.bvh
  cospeech live --model MODEL --play speech.wav --latency
  cospeech live --model MODEL --play speech.wav --style energetic=0.7 --osc 9000
  cospeech live --model MODEL --microphone --keys --keywords-from pocketsphinx

docs/live.md explains receivers, delays and styles."""


def add(commands: argparse._SubParsersAction[Parser]) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "live",
        usage="cospeech live [options]",
        help="gesture while somebody speaks",
        description=DESCRIPTION,
        epilog=EPILOG,
    )
    parser.add_argument(
        "--model",
        type=Path,
        metavar="FOLDER",
        help="folder of a trained model (default: the bundled model of a virtual actor)",
    )
    sources = parser.add_mutually_exclusive_group()
    sources.add_argument("--pcm", metavar="FORMAT", help=f"format of the samples on standard input (default: {PCM})")
    sources.add_argument("--play", type=Path, metavar="FILE", help="sound file to listen to, in real time")
    sources.add_argument(
        "--microphone", nargs="?", const="", metavar="DEVICE", help="listen to a microphone, by name or number"
    )
    add_channel(parser)
    parser.add_argument(
        "--vmc",
        type=_vmc,
        default=_vmc(VMC),
        metavar="HOST:PORT",
        help=f"where to send motion to, or off (default: {VMC})",
    )
    parser.add_argument(
        "--web",
        type=_web,
        metavar="PORT",
        help="show the motion on a page in the browser, as [HOST:]PORT (default host: this machine only)",
    )
    parser.add_argument(
        "--record",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="record the motion, as FILE.bvh, FILE.parquet or FILE.csv",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace existing recordings")
    parser.add_argument(
        "--style",
        type=_style,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="style of the motion, if the model has styles",
    )
    parser.add_argument(
        "--osc",
        type=_osc,
        metavar="PORT",
        help="listen for /style NAME VALUE and /keyword WORD, as [HOST:]PORT",
    )
    parser.add_argument(
        "--keys", action="store_true", help="let keys of the terminal call for keywords and styles, which are listed"
    )
    parser.add_argument(
        "--keywords-from",
        choices=["pocketsphinx"],
        help="recognise the keywords of the model in the sound (English; pip install 'cospeech[keywords]')",
    )
    parser.add_argument(
        "--seed", type=whole_number(0), metavar="N", help="seed of random draws (default: that of the model)"
    )
    parser.add_argument("--latency", action="store_true", help="print the distribution of delays at the end")
    parser.add_argument(
        "--recover", type=Path, metavar="FILE", help="complete FILE.recording, which a killed run has left, and stop"
    )
    parser.set_defaults(execute=run, error=parser.error)


def _address(text: str, host: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":") if ":" in text else (host, "", text)
    if not (host and port.isascii() and port.isdecimal() and 0 < int(port) < 65536):
        raise argparse.ArgumentTypeError(f"'{text}' is not a host and a port from 1 to 65535, such as {VMC}")
    return host.strip("[]"), int(port)


def _vmc(text: str) -> tuple[str, int] | None:
    return None if text == "off" else _address(text, "")


def _web(text: str) -> tuple[str, int]:
    return _address(text, "127.0.0.1")


def _osc(text: str) -> tuple[str, int]:
    return _address(text, THIS_MACHINE)


def _style(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is not a style and a number, such as energetic=0.7") from error


def run(arguments: argparse.Namespace) -> int:
    """Run until the sound ends or a signal stops it."""
    if arguments.recover is not None:
        return _recover(arguments)
    if arguments.microphone is not None and arguments.channel is not None:
        arguments.error("--channel belongs to --pcm and --play")
    if arguments.vmc is None and arguments.web is None and not arguments.record:
        arguments.error("nothing shows the motion; leave out --vmc off, or add --web or --record")
    begun_s = time.perf_counter()
    note_compilation()
    with _signals() as stoppable:
        running, model = _engine(arguments, begun_s)
        stoppable.append(running)
        running.run()
    if running.n_frames:
        for path in arguments.record:
            print(path, flush=True)
    else:
        note("no motion was made because the sound was shorter than a frame")
    for line in running.remarks():
        note(line)
    if arguments.latency:
        print(running.out_delays.line("sound in to motion out"))
        if "syllables" in model.system.needs:
            print(running.syllable_delays.line("syllable peak to known"))
    return 0


def _recover(arguments: argparse.Namespace) -> int:
    from cospeech.live import recording

    print(recording.recover(arguments.recover, arguments.overwrite))
    return 0


def _engine(arguments: argparse.Namespace, begun_s: float) -> tuple[Engine, ActorModel | HeadModel]:
    """Return the engine, ready to run, and its model; ``begun_s`` is when the command was called."""
    # Not above: these load pandas and the compiled kernels.
    from cospeech.live import engine, heads, performing, recording, vmc
    from cospeech.live.recogniser import Recogniser

    for path in arguments.record:
        recording.check(path, arguments.overwrite)
    with ExitStack() as opened:
        source = _source(arguments, begun_s)
        opened.callback(source.close)
        model = _model(arguments.model)
        if arguments.model is None:
            note("using the bundled model, which was learned from a virtual actor and not from people")
        hearing = engine.listening(model, source.rate_hz)
        seed = model.card["seed"] if arguments.seed is None else arguments.seed
        performer = performing.performer(model, hearing, seed)
        for name, value in arguments.style:
            performer.prepare(f"style:{name}", value)()
        fps = float(model.card["motion_fps"])
        listeners = _listeners(arguments, performer.controls, opened)
        recogniser = None
        if arguments.keywords_from is not None:
            recogniser = Recogniser(performer.controls.keywords, source.rate_hz, note)
            opened.callback(recogniser.close)
        outputs: list[Output] = []
        head_alone = model.system.makes == "head"
        if arguments.vmc is not None:
            host, port = arguments.vmc
            sent = vmc.Vmc(performer.body, host, port, note)
            outputs.append(heads.OnBody(sent) if head_alone else sent)
            opened.callback(outputs[-1].close)
        shown = None
        if arguments.web is not None:
            from cospeech.live import web

            shown = web.Page(performer.body, fps, performer.controls, *arguments.web)
            opened.callback(shown.close)
            outputs.append(heads.OnBody(shown) if head_alone else shown)
            listeners.append(shown)
        body = None if head_alone else performer.body
        for path in arguments.record:
            outputs.append(recording.Recorder(path, body, fps, model.card, arguments.overwrite, note))
            opened.callback(outputs[-1].close)
        engine.warm_up(model)
        opened.pop_all()  # from here on, the engine closes them
    if arguments.vmc is not None:
        note(f"sending VMC to {':'.join(map(str, arguments.vmc))}; Ctrl-C stops")
    running = engine.Engine(source, hearing, performer, outputs, fps, note, listeners, recogniser)
    if shown is not None:
        shown.follow(lambda: running.arrived_s)
        note(f"open {shown.address}/ in a browser")
    return running, model


def _model(folder: Path | None) -> ActorModel | HeadModel:
    """Return the model of a folder, or the bundled one."""
    from cospeech import api

    if folder is not None and api.system_of_model(folder).makes == "head":
        return api.load_head_model(folder)
    return api.load_model(folder)


def _listeners(arguments: argparse.Namespace, offered: Controls, opened: ExitStack) -> list[Listener]:
    """Return where changes come from, except for what is recognised in the sound."""
    from cospeech.live import keys, osc

    listeners: list[Listener] = []
    if arguments.osc is not None:
        listeners.append(osc.Messages(*arguments.osc))
        opened.callback(listeners[-1].close)
    if arguments.keys:
        known = keys.bindings(offered)
        listeners.append(keys.Keys(known))
        opened.callback(listeners[-1].close)
        note(keys.line(known))
    return listeners


def _source(arguments: argparse.Namespace, begun_s: float) -> Source:
    from cospeech.live import sound

    if arguments.play is not None:
        played = sound.File(arguments.play, arguments.channel)
        for remark in played.notes:
            note(f"{arguments.play}: {remark}")
        return played
    if arguments.microphone is not None:
        return sound.Microphone(arguments.microphone or None)
    pcm = sound.parse_pcm(arguments.pcm or PCM)
    standard_input = 0
    try:
        waits_for_keys = os.isatty(standard_input)
        os.fstat(standard_input)
    except OSError:
        waits_for_keys = True
    if waits_for_keys:
        raise UserError(
            "no sound on standard input; pipe samples to it ('cospeech live --help' has examples), or name a file "
            "with --play, or listen to a --microphone"
        )
    return sound.Pipe(standard_input, pcm, arguments.channel, begun_s)


@contextmanager
def _signals() -> Iterator[list[Engine]]:
    """Let SIGINT (Ctrl-C) and SIGTERM stop the engine that is put into the list; before that, they end the program.

    A second Ctrl-C interrupts the engine.
    """
    running: list[Engine] = []

    def stop(number: int, _: FrameType | None) -> None:
        if not running:
            sys.exit(128 + number)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        running[0].stop()

    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, stop) for number in numbers]
    try:
        yield running
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)

"""``cospeech live``: sound in, motion out, files complete however it ends, and one line for each mistake."""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from cospeech import cli
from cospeech.commands import live
from cospeech.data import tables
from cospeech.formats import bvh, sound

BUNDLED = "cospeech: using the bundled model, which was learned from a virtual actor and not from people"
PROGRAM = "import sys; from cospeech import cli; sys.exit(cli.main())"


class Ended:
    """How a call ended: exit status, lines on stdout and stderr."""

    def __init__(self, status, printed):
        self.status = status
        self.out, self.err = printed.out.splitlines(), printed.err.splitlines()


@pytest.fixture
def call(capfd, monkeypatch, recordings, tmp_path):
    """Run the command in an empty folder with a copy of speech.wav; ``heard`` is what stands on standard input."""
    shutil.copy(recordings / "speech.wav", tmp_path)
    monkeypatch.chdir(tmp_path)

    def run(*arguments, heard=None):
        capfd.readouterr()
        before = os.dup(0)
        descriptor = os.open(os.devnull if heard is None else heard, os.O_RDONLY)
        os.dup2(descriptor, 0)
        try:
            status = cli.main(["live", *map(str, arguments)])
        except SystemExit as ended:
            status = ended.code
        finally:
            os.dup2(before, 0)
            os.close(before)
            os.close(descriptor)
        return Ended(status, capfd.readouterr())

    return run


def files():
    """Every file below the current folder, but for the sound."""
    return {str(path) for path in Path().rglob("*")} - {"speech.wav", "speech.raw"}


@pytest.fixture
def raw(call):
    """The speech as samples without a header."""
    samples = sound.read("speech.wav").samples
    sound.to_16_bit(samples).astype("<i2").tofile("speech.raw")
    return samples


def test_sound_on_standard_input_becomes_bvh_and_a_table_as_long_as_the_sound(call, raw):
    ended = call("--vmc", "off", "--record", "a.bvh", "--record", "a.parquet", heard="speech.raw")
    assert (ended.status, ended.out, ended.err) == (0, ["a.bvh", "a.parquet"], [BUNDLED])
    assert files() == {"a.bvh", "a.parquet"}
    motion = tables.read("a.parquet", "motion")
    assert len(bvh.read("a.bvh").rotations) == len(motion) == 250
    assert np.ptp(motion["left_arm_x_deg"]) > 5
    assert tables.read_metadata("a.parquet")["corpus"] == "virtual"


def test_a_file_that_is_played_is_sent_to_a_receiver(call, raw):
    sound.write(raw[40_000:56_000], "short.wav")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(10.0)
        port = receiver.getsockname()[1]
        ended = call("--play", "short.wav", "--vmc", f"127.0.0.1:{port}", "--latency")
        packets = [receiver.recv(2000) for _ in range(50)]
    assert ended.status == 0
    assert ended.err == [BUNDLED, f"cospeech: sending VMC to 127.0.0.1:{port}; Ctrl-C stops"]
    assert sum(b"/VMC/Ext/OK" in packet for packet in packets) == 25
    (line,) = ended.out
    assert re.fullmatch(r"sound in to motion out: median .* ms, 90 % .* ms, 99 % .* ms, longest .* ms \(25\)", line)


def wait_for(path, n_frames):
    """Wait until a growing recording has so many frames of the body."""
    while not (path.exists() and path.stat().st_size >= 2000 + n_frames * 71 * 8):
        time.sleep(0.02)


@pytest.fixture
def open_pipe(raw):
    """A pipe with the speech that nobody closes: what it is read from, by path."""
    ends = os.pipe()
    writer = threading.Thread(target=os.write, args=(ends[1], Path("speech.raw").read_bytes()))
    writer.start()
    yield f"/dev/fd/{ends[0]}"
    for end in ends:
        os.close(end)
    writer.join()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_it_and_completes_the_files(call, open_pipe, number):
    def interrupt():
        wait_for(Path("a.bvh.recording"), 240)
        os.kill(os.getpid(), number)

    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    thread = threading.Thread(target=interrupt)
    thread.start()
    ended = call("--vmc", "off", "--record", "a.bvh", heard=open_pipe)
    thread.join()
    assert (ended.status, ended.out, ended.err) == (0, ["a.bvh"], [BUNDLED])
    assert files() == {"a.bvh"}
    assert len(bvh.read("a.bvh").rotations) >= 240
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_before_anything_is_heard_leaves_nothing(call, monkeypatch, number, status):
    from cospeech.live import engine

    monkeypatch.setattr(engine, "warm_up", lambda model: os.kill(os.getpid(), number))
    ended = call("--vmc", "off", "--record", "a.bvh")
    assert (ended.status, ended.out, ended.err, files()) == (status, [], [BUNDLED], set())


def test_a_second_interruption_leaves_what_can_be_recovered(call, raw, monkeypatch):
    from cospeech.live import engine, recording

    class Interrupted(engine.Engine):
        def _wait(self):
            if self.n_frames == 100 and not self._stopped:
                os.kill(os.getpid(), signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(engine, "Engine", Interrupted)
        patch.setattr(recording, "complete", lambda growing, path: os.kill(os.getpid(), signal.SIGINT))
        ended = call("--vmc", "off", "--record", "a.bvh", heard="speech.raw")
    assert (ended.status, ended.err[-1], files()) == (130, "cospeech: interrupted", {"a.bvh.recording"})
    assert recording.recover(Path("a.bvh.recording"), False) == Path("a.bvh")
    assert len(bvh.read("a.bvh").rotations) >= 100


def test_a_killed_run_is_recovered(call, open_pipe):
    with Path(open_pipe).open("rb") as heard:
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, "live", "--vmc", "off", "--record", "a.bvh"], stdin=heard
        )
    wait_for(Path("a.bvh.recording"), 240)
    process.kill()
    process.wait()
    assert files() == {"a.bvh.recording"}
    ended = call("--record", "a.bvh", "--vmc", "off")
    assert (ended.status, len(ended.err)) == (1, 2)
    assert "complete it with 'cospeech live --recover a.bvh.recording', or delete it" in ended.err[1]
    ended = call("--recover", "a.bvh.recording")
    assert (ended.status, ended.out, ended.err) == (0, ["a.bvh"], [])
    assert len(bvh.read("a.bvh").rotations) >= 240
    assert files() == {"a.bvh"}


def test_sound_without_a_whole_frame_makes_nothing(call):
    ended = call("--vmc", "off", "--record", "a.bvh")
    assert (ended.status, ended.out) == (0, [])
    assert ended.err == [BUNDLED, "cospeech: no motion was made because the sound was shorter than a frame"]
    assert files() == set()


def test_what_was_wrong_with_the_sound_is_said(call):
    samples = np.full(8000, 2.0, dtype="<f4")
    samples[:7] = np.nan
    samples.tofile("speech.raw")
    ended = call("--pcm", "16000:f32le", "--vmc", "off", "--record", "a.bvh", heard="speech.raw")
    assert ended.err[1:] == [
        "cospeech: 7 samples were not finite numbers, and counted as silence",
        "cospeech: 7993 samples at full scale: recorded too loud",
    ]


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--pcm", "16k"), "'16k' is not a sampling rate"),
        (("--pcm", "16000:mp3"), "unknown format 'mp3'; known are u8"),
        (("--channel", "2"), "--channel 2: the sound has 1 channel"),
        (("--play", "none.wav"), "none.wav: no such file"),
        (("--model", "none"), "none: no such model folder"),
        (("--record", "old.bvh"), "old.bvh: already exists; replace it with --overwrite"),
        (("--record", "none/a.bvh"), "none/a.bvh: the folder none does not exist"),
        (("--record", "a.fbx"), "a.fbx: the name of a recording ends in .bvh, .parquet or .csv"),
        (("--record", "b.bvh", "--record", "old.bvh"), "old.bvh: already exists"),
        (("--style", "energetic=0.7"), "'hsmm_sampled' of this model has no styles and no keywords"),
        (("--keys",), "--keys: the model has no keywords and no styles"),
        (("--keywords-from", "pocketsphinx"), "--keywords-from pocketsphinx: the model has no keywords"),
        (("--vmc", "no.such.host.invalid:1"), "--vmc no.such.host.invalid:1: no such host"),
        (("--recover", "none.bvh.recording"), "none.bvh.recording: cannot be read"),
    ],
)
def test_wrong_input_takes_one_line_and_leaves_nothing(call, arguments, complaint):
    Path("old.bvh").write_text("kept")
    ended = call(*arguments)
    assert (ended.status, ended.out) == (1, [])
    (line,) = [line for line in ended.err if line != BUNDLED]
    assert line.startswith("cospeech: ")
    assert complaint in line
    assert files() == {"old.bvh"}
    assert Path("old.bvh").read_text() == "kept"


def test_a_port_in_use_takes_one_line(call):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        ended = call("--osc", port, "--record", "a.bvh")
    assert (ended.status, files()) == (1, set())
    assert ended.err[-1].startswith(f"cospeech: --osc 127.0.0.1:{port}: cannot listen there")
    assert ended.err[-1].endswith("; choose another port")


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--play", "a.wav", "--pcm", "16000"), "not allowed with argument"),
        (("--vmc", "off"), "nothing shows the motion; leave out --vmc off, or add --web or --record"),
        (("--vmc", "here"), "'here' is not a host and a port from 1 to 65535, such as 127.0.0.1:39539"),
        (("--vmc", ":39539"), "':39539' is not a host and a port"),
        (("--osc", "0"), "'0' is not a host and a port"),
        (("--style", "energetic"), "'energetic' is not a style and a number, such as energetic=0.7"),
        (("--microphone", "--channel", "1"), "--channel belongs to --pcm and --play"),
        (("--seed", "-1"), "'-1' is not a whole number, 0 or greater"),
    ],
)
def test_a_wrong_call_ends_with_status_2(call, arguments, complaint):
    ended = call(*arguments)
    assert (ended.status, ended.out) == (2, [])
    assert complaint in ended.err[-1]


def test_a_terminal_is_no_sound(call, monkeypatch):
    monkeypatch.setattr(live.os, "isatty", lambda descriptor: True)
    ended = call("--record", "a.bvh")
    assert (ended.status, files()) == (1, set())
    assert ended.err[0].startswith("cospeech: no sound on standard input; pipe samples to it")

"""The engine: live motion is offline motion to the last bit, at the right speed, and only the end stops it."""

import gc
import json
import socket
import threading
import time
import tracemalloc

import numpy as np
import pytest
from pythonosc.osc_message_builder import build_msg
from stand_in import AtOnce, Chunks, Method, Sink, run

from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.live import changes, engine
from cospeech.live.changes import Change
from cospeech.live.osc import Messages
from cospeech.live.recording import Recorder
from cospeech.live.sound import File
from cospeech.live.vmc import Vmc
from cospeech.motion.body import STANDARD
from cospeech.speech import syllables
from cospeech.synthesis import live
from cospeech.synthesis.interface import Speech


def offline(model, samples, n_frames):
    """The motion table that the system makes of a whole recording."""
    found = syllables.table("stream", syllables.find(samples, 16000))
    speech = Speech("stream", 0.025, len(samples) // 400, syllables=found, motion_fps=25.0, n_motion_frames=n_frames)
    return live.by_steps(model.trained.method, "motion", model.trained.model, speech, 3).motion


@pytest.mark.parametrize("size", [1, 37, 400, 100_000])
@pytest.mark.parametrize("length", [160_000, 123_457])
def test_live_motion_is_offline_motion_to_the_last_bit(model, samples, tmp_path, size, length):
    spoken = samples[:length] if size > 1 else samples[16_000 : 16_000 + length // 8]
    recorder = Recorder(tmp_path / "x.parquet", STANDARD, 25.0, model.card, False, print)
    running, frames = run(model, Chunks(spoken, size), [recorder], seed=3)
    n_frames = round(len(spoken) / 16000 * 25)
    assert len(frames) == running.n_frames == n_frames
    recorded = tables.read(tmp_path / "x.parquet", "motion")
    assert recorded.equals(offline(model, spoken, n_frames))
    assert recorded["head_x_deg"].nunique() > n_frames // 2


class Clock:
    """Time that passes only while somebody sleeps."""

    def __init__(self):
        self.now_s = 100.0

    def perf_counter(self):
        return self.now_s

    def sleep(self, seconds):
        self.now_s += seconds


@pytest.fixture
def clock(monkeypatch):
    made = Clock()
    monkeypatch.setattr(engine, "time", made)
    return made


class Timed(Sink):
    """An output that somebody watches, and when it was shown each frame."""

    def __init__(self, clock):
        super().__init__(in_real_time=True)
        self.clock, self.shown_s = clock, []

    def show(self, frame, time_s, pose):
        super().show(frame, time_s, pose)
        self.shown_s.append(self.clock.now_s - 100.0)


def test_sound_that_arrives_too_fast_is_held_back_only_if_somebody_watches(model, samples, clock):
    run(model, Chunks(samples, 100_000))
    assert clock.now_s == 100.0
    watched = Timed(clock)
    run(model, Chunks(samples, 100_000), [watched])
    late_s = np.array(watched.shown_s[:-1]) - watched.times_s[:-1]
    assert late_s.min() > -0.6
    assert late_s.max() < 0.03


def test_sound_that_piled_up_while_everything_was_loaded_is_caught_up_with(model, samples, clock):
    source, watched = Chunks(samples, 400), Timed(clock)
    source.begun_s = 97.0
    run(model, source, [watched])
    late_s = np.array(watched.shown_s) - watched.times_s + 3.0
    assert watched.shown_s[74] == 0.0
    assert late_s[80:].max() < 0.03


def test_a_file_is_heard_in_real_time(model, recordings, clock):
    watched = Timed(clock)
    run(model, File(recordings / "speech.wav"), [watched])
    late_s = np.array(watched.shown_s) - watched.times_s
    assert late_s.min() >= -1e-6
    assert late_s.max() < 0.05


def test_a_stall_is_reported_and_what_piled_up_is_caught_up_with(model, samples, clock):
    """The sound stalls for five seconds, and then all of it arrives at once."""

    class Stalling(Chunks):
        def read(self, wait_s):
            block = super().read(wait_s)
            if block is not None and not len(block):
                clock.sleep(wait_s)
            return block

    blocks = [samples[k : k + 400] for k in range(0, 40_000, 400)]
    nothing = [np.empty(0)] * round(5 / engine.WAIT_S)
    said = []
    watched = Timed(clock)
    running, frames = run(
        model, Stalling([], [*blocks, *nothing, samples[40_000:120_000], samples[120_000:]]), [watched], said=said
    )
    assert said == ["no sound for 2 s; waiting for more", "sound again after 5.0 s"]
    _, expected = run(model, Chunks(samples, 400))
    np.testing.assert_array_equal(frames, expected)
    late_s = np.array(watched.shown_s) - watched.times_s
    assert late_s[70:100].max() > 3.0
    assert late_s[-60:].max() < 0.03
    assert running.out_delays.longest_s < 0.03  # it is not late for the sound, which arrived late itself


def test_sound_of_any_kind_makes_as_much_motion(model, samples):
    some = samples[20_000:45_000]
    made = [run(model, Chunks(spoken, 777))[1] for spoken in (0.0 * some, np.nan * some, np.sign(some), 1e30 * some)]
    assert all(len(frames) == 39 and np.isfinite(frames).all() for frames in made)
    np.testing.assert_array_equal(made[0], made[1])
    assert (made[2] != made[0]).any()


def test_memory_does_not_grow_while_nobody_speaks(model, tmp_path):
    class Forgetful(Chunks):
        def __init__(self, n):
            super().__init__([], [])
            self.n = n

        def read(self, wait_s):
            self.n -= 1
            return np.zeros(400) if self.n >= 0 else None

    held = []

    class Nobody:
        in_real_time = False

        def show(self, frame, time_s, pose):
            if frame in (25 * 10, 25 * 30):
                gc.collect()
                held.append(tracemalloc.get_traced_memory()[0])

        def close(self):
            pass

    hearing = engine.listening(model, 16000)
    recorder = Recorder(tmp_path / "x.bvh", STANDARD, 25.0, model.card, False, print)
    outputs = [Nobody(), recorder, Vmc(STANDARD, "127.0.0.1", 9, print)]
    outputs[2].in_real_time = False
    running = engine.Engine(Forgetful(40 * 31), hearing, engine.performer(model, hearing, 0), outputs, 25.0, print)
    tracemalloc.start()
    try:
        running.run()
    finally:
        tracemalloc.stop()
    assert held[1] - held[0] < 8 * 20 * 25  # less than one number per frame


def test_remarks_say_what_was_wrong(model, samples):
    wrong = samples[:16_000].copy()
    wrong[:3], wrong[100:120] = np.nan, 2.0
    running, _ = run(model, Chunks(wrong, 400))
    assert running.remarks() == [
        "3 samples were not finite numbers, and counted as silence",
        "20 samples at full scale: recorded too loud",
    ]
    assert run(model, Chunks(samples[:16_000], 400))[0].remarks() == []


@pytest.mark.parametrize("length", [0, 1, 399])
def test_a_stream_that_stops_at_once_makes_nothing(model, samples, length):
    running, frames = run(model, Chunks(samples[:length], 400))
    assert running.n_frames == len(frames) == 0


def test_it_can_be_stopped_and_completes_what_it_has(model, samples, tmp_path):
    class Interrupting(Sink):
        def show(self, frame, time_s, pose):
            super().show(frame, time_s, pose)
            if frame == 20:
                running.stop()

    sink = Interrupting()
    recorder = Recorder(tmp_path / "x.parquet", STANDARD, 25.0, model.card, False, print)
    source = Chunks(samples, 100_000)
    hearing = engine.listening(model, 16000)
    running = engine.Engine(source, hearing, engine.performer(model, hearing, 0), [sink, recorder], 25.0, print)
    running.run()
    assert len(tables.read(tmp_path / "x.parquet", "motion")) == len(sink.frames) in range(21, 24)


def test_an_output_that_cannot_be_completed_does_not_keep_the_others_from_it(model, samples):
    class Failing(Sink):
        def close(self):
            super().close()
            raise UserError("the disk is full")

    outputs, said = [Failing(), Failing(), Sink()], []
    with pytest.raises(UserError, match="the disk is full"):
        run(model, Chunks(samples[:8000], 400), outputs, said=said)
    assert all(output.closed for output in outputs)
    assert said == ["the disk is full"]


def test_a_system_that_fails_does_not_lose_what_was_recorded(model, samples, tmp_path):
    class Breaking(type(model.trained.method)):
        def step(self, state, heard):
            if heard.frame == 100:
                raise UserError("the system is broken")
            return super().step(state, heard)

    broken = model._replace(trained=model.trained._replace(method=Breaking()))
    recorder = Recorder(tmp_path / "x.parquet", STANDARD, 25.0, model.card, False, print)
    with pytest.raises(UserError, match="the system is broken"):
        run(broken, Chunks(samples, 400), [recorder])
    assert len(tables.read(tmp_path / "x.parquet", "motion")) == 63


@pytest.mark.parametrize("wrong", [np.zeros((1, 70)), np.zeros(71), np.full((1, 71), np.nan)])
def test_what_is_not_motion_is_refused_before_it_is_recorded(model, samples, tmp_path, wrong):
    class Wrong(type(model.trained.method)):
        def step(self, state, heard):
            return wrong if heard.frame == 50 else super().step(state, heard)

    broken = model._replace(trained=model.trained._replace(method=Wrong()))
    recorder = Recorder(tmp_path / "x.bvh", STANDARD, 25.0, model.card, False, print)
    with pytest.raises(UserError, match="'nods' declares that it makes motion, but it returned an array of shape"):
        run(broken, Chunks(samples, 400), [recorder])
    assert (tmp_path / "x.bvh").is_file()


def test_changes_arrive_while_it_runs_and_wrong_ones_are_reported(model, samples, monkeypatch):
    monkeypatch.setattr(changes, "ThreadPoolExecutor", AtOnce)
    listener = Messages("127.0.0.1", 0)
    address = listener._socket.getsockname()
    said = []

    class Sending(Chunks):
        def read(self, wait_s):
            if len(self.chunks) in (300, 200, 100):
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
                    for message in messages.pop():
                        sender.sendto(build_msg(*message).dgram, address)
            return super().read(wait_s)

    messages = [
        [("/keyword", ["left"])],
        [("/style", ["sleepy", 1.0]), ("/nod", [])],
        [("/style", ["energetic", 0.0])],
    ]
    _, changed = run(model, Sending(samples, 400), listeners=[listener], said=said)
    assert said[0].startswith("OSC: '/nod ' is unknown")
    assert said[1] == "unknown style 'sleepy'; known are energetic"
    _, plain = run(model, Chunks(samples, 400))
    first = int(np.flatnonzero((changed != plain).any(axis=1))[0])
    assert 62 < first < 100  # from 2.5 s on, syllables no longer move it


def test_motion_goes_on_while_a_style_is_prepared(model, samples):
    """The style is ready only after 40 frames, which the engine can show only if it does not wait for the style."""
    shown = threading.Event()

    class Watching(Sink):
        def show(self, frame, time_s, pose):
            super().show(frame, time_s, pose)
            if frame == 40:
                shown.set()

    class Slow(Method):
        def prepare(self, state, name, value):
            assert shown.wait(60.0)
            return super().prepare(state, name, value)

    class Faders:
        def __init__(self):
            self.sent = [Change("style:energetic", 0.0)]

        def changes(self):
            while self.sent:
                yield self.sent.pop()

        def close(self):
            pass

    class Waiting(Chunks):
        """Waits after frame 40 until the style has been changed, so that it is seen in the rest of the motion."""

        def read(self, wait_s):
            if shown.is_set() and states[-1]["energy"] == 1.0:
                time.sleep(0.001)
                return np.empty(0)
            return super().read(wait_s)

    states = []
    slow = Slow()
    slow.start = lambda *given: states.append(Method.start(slow, *given)) or states[-1]
    watched = Watching()
    _, changed = run(
        model._replace(trained=model.trained._replace(method=slow)), Waiting(samples, 400), [watched], [Faders()]
    )
    _, plain = run(model, Chunks(samples, 400))
    np.testing.assert_array_equal(changed[:40], plain[:40])
    assert (changed[60:] != plain[60:]).any()


def test_delays_are_counted_per_frame_and_per_syllable(model, samples):
    running, frames = run(model, Chunks(samples, 400))
    found = [one for one in syllables.find(samples, 16000) if one.known_s <= 10.0]
    assert (running.out_delays.n, running.syllable_delays.n) == (len(frames), len(found))
    delays_s = [one.known_s - one.peak_s for one in found]
    assert running.syllable_delays.longest_s == max(delays_s)
    assert running.syllable_delays.quantile_s(0.5) == pytest.approx(
        np.quantile(delays_s, 0.5, method="lower"), rel=0.05
    )
    assert json.dumps(running.out_delays.line("out")).count("ms") == 4


def test_everything_can_be_warmed_up(model):
    engine.warm_up(model)

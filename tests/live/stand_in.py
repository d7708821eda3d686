"""A live system that makes motion, sources that deliver what they are given, and an output that keeps all frames."""

from __future__ import annotations

from concurrent.futures import Future

import numpy as np

from cospeech.errors import UserError
from cospeech.synthesis.declaration import System
from cospeech.synthesis.live import Controls

SYSTEM = System(
    name="nods", title="Nods", method="cospeech.synthesis.nods", needs=("syllables",), makes="motion", live=True
)


class Method:
    """Turns each joint about x by an angle that all syllables heard so far have moved."""

    def start(self, model, stream, seed):
        return {"model": model, "fps": stream.motion_fps, "n": 0, "place": float(seed), "energy": 1.0, "words": []}

    def step(self, state, heard):
        for syllable in heard.syllables:
            state["place"] += 1e-3 * state["energy"] * sum(np.nan_to_num(list(syllable.values())))
        return self._frames(state, int((heard.frame + 1) * 0.025 * state["fps"] + 0.5))

    def end(self, state, speech):
        return self._frames(state, speech.n_motion_frames)

    def controls(self, model):
        return Controls(("left", "right"), ("energetic",))

    def prepare(self, state, name, value):
        if name == "keyword":
            return lambda: state["words"].append(value)
        if name == "style:energetic":
            return lambda: state.update(energy=value)
        raise UserError(f"unknown style '{name.removeprefix('style:')}'; known are energetic")

    def _frames(self, state, end):
        rows = np.zeros((max(end - state["n"], 0), 3 + 4 * 17))
        for number, row in enumerate(rows, start=state["n"]):
            angle = state["model"] * np.sin(state["place"] + 0.1 * number)
            row[0] = 0.01 * np.sin(number)
            row[3::4], row[4::4] = np.cos(angle / 2), np.sin(angle / 2)
        state["n"] = max(end, state["n"])
        return rows


class AtOnce:
    """Takes the place of a thread, but does everything when it is asked."""

    def __init__(self, *_):
        pass

    def submit(self, work, *arguments):
        made = Future()
        try:
            made.set_result(work(*arguments))
        except UserError as error:
            made.set_exception(error)
        return made

    def shutdown(self, **_):
        pass


class Chunks:
    """A source of samples in chunks of the given size, or of the given list."""

    in_real_time = False
    n_lost = 0
    begun_s = None

    def __init__(self, samples, size, rate_hz=16000):
        self.rate_hz = rate_hz
        self.chunks = (
            size if isinstance(size, list) else [samples[k : k + size] for k in range(0, len(samples), size)]
        )
        self.closed = False

    def read(self, wait_s):
        return self.chunks.pop(0) if self.chunks else None

    def close(self):
        self.closed = True


class Sink:
    """Keeps all frames."""

    def __init__(self, in_real_time=False):
        self.in_real_time = in_real_time
        self.frames, self.times_s = [], []
        self.closed = False

    def show(self, frame, time_s, pose):
        assert frame == len(self.frames)
        self.frames.append(pose.copy())
        self.times_s.append(time_s)

    def close(self):
        self.closed = True


def run(model, source, outputs=(), listeners=(), seed=0, said=None, fps=25.0):
    """Run the engine until the source ends; return it and all frames, (n, 3 + 4 J)."""
    from cospeech.live import engine, performing

    sink = Sink()
    hearing = engine.listening(model, source.rate_hz)
    performer = performing.performer(model, hearing, seed)
    lines = [] if said is None else said
    running = engine.Engine(source, hearing, performer, [sink, *outputs], fps, lines.append, listeners)
    running.run()
    assert sink.closed
    return running, np.array(sink.frames)

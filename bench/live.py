"""Measure live motion: processing per frame of sound, and the delay over the loopback interface: python bench/live.py

Ten minutes of studio voices are heard in chunks of a frame, as by ``cospeech live``, garbage collection included: 25
ms of prosody or, by systems that move the head alone, 10 ms of melody.

- *Processor time* per chunk: hearing and system, in one pass. *Best of three* takes the best of three passes of each
  chunk, which is what remains when neither other programs nor garbage collection disturb; then the same with the
  packets of the VMC protocol. Goal: 60 us at the 99th percentile for systems that run live.
- *Loopback*: a thread writes sound to a pipe in blocks of 10 ms, as a microphone would, and another one receives the
  packets. The delay is that of each frame after the sound at its time: it contains the time until the block and the
  prosody frame are complete (at most 35 ms), but not the analysis window of a syllable. The first second is left out.
- *Syllables*: from the peak of a syllable until it is known.

The stand-in moves through a recording with the blending of ``motion.blending``. ``hsmm_sampled`` is the bundled
model, which decodes the last minute again at every tenth chunk. The others are trained on three minutes of a studio
actor, if they are installed; those of heads, on melodies and heads of three minutes of noise, because what is learnt
does not change the time that a step takes.
"""

from __future__ import annotations

import gc
import os
import socket
import struct
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
from syllables import studio

from cospeech import api
from cospeech.api import ActorModel, HeadModel
from cospeech.data.arrays import Floats
from cospeech.errors import UserError
from cospeech.formats import bvh, sound
from cospeech.live import engine, performing
from cospeech.live.heads import OnBody
from cospeech.live.sound import Pcm, Pipe
from cospeech.live.vmc import Packets, Vmc
from cospeech.motion import head, library
from cospeech.motion.blending import Blender
from cospeech.motion.body import STANDARD
from cospeech.speech import melody
from cospeech.studio import cast, motion, script, voice
from cospeech.synthesis.declaration import System
from cospeech.synthesis.registry import installed
from cospeech.synthesis.session import Session, Trained
from cospeech.synthesis.training import head_fold

RATE_HZ, SECONDS, LOOPBACK_S, SEED = 16000, 600, 20, 2012
BLOCK_S, FRAME_S = 0.01, 0.025
WAIT_S = 5.0
"""Time without packets after which none is expected: longer than the lag of a head."""

SYSTEMS = ("controller", "bodylanguage")
HEADS = ("head", "head_weighted", "iohmm")


class StandIn:
    """A live system that moves to another place of a recording with every syllable."""

    def start(self, model: Any, stream: Any, seed: int) -> dict[str, Any]:  # noqa: ARG002
        """Return the state before anything is heard."""
        return {"poses": model, "blender": Blender(STANDARD), "place": 1, "n": 0, "fps": stream.motion_fps}

    def step(self, state: dict[str, Any], heard: Any) -> Floats:
        """Return the frames up to the time that has been heard."""
        for syllable in heard.syllables:
            state["place"] = 1 + int(1000 * syllable["peak_s"]) % 900
        return self._frames(state, int((heard.frame + 1) * 0.025 * state["fps"] + 0.5))

    def end(self, state: dict[str, Any], speech: Any) -> Floats:
        """Return the last frames."""
        return self._frames(state, speech.n_motion_frames)

    def _frames(self, state: dict[str, Any], end: int) -> Floats:
        poses, rows = state["poses"], np.empty((max(end - state["n"], 0), 71))
        for row in rows:
            here = state["place"] = state["place"] % (len(poses.root_m) - 1) + 1
            row[:] = state["blender"].step(
                poses.root_m[here], poses.rotations[here], poses.root_m[here - 1], poses.rotations[here - 1]
            )
        state["n"] = max(end, state["n"])
        return rows


def stand_in() -> ActorModel:
    """Return the bundled model with the stand-in for its system."""
    model = api.load_model()
    system = System(
        name="stand-in", title="Stand-in", method="cospeech.bench", needs=("syllables",), makes="motion", live=True
    )
    poses = library.from_motion(next(iter(model.motions.values())))
    return model._replace(system=system, trained=Trained(StandIn(), poses))


def actor_records(folder: Path) -> list[api.Record]:
    """Return three minutes of a studio actor."""
    actor = cast.member("ada", SEED, 0.025, 10.0)
    records = []
    for name in ("talk_1", "talk_2", "talk_3"):
        gestures, prosody = script.write(actor, name, 60.0, 0.8, 0.025, SEED)
        samples, _ = voice.speak(name, prosody, "Female2", "memory", 0.025, SEED)
        sound.write(samples, folder / f"{name}.wav")
        bvh.write(motion.perform("ada", name, gestures, prosody, 25.0, SEED), folder / f"{name}.bvh")
        records.append(api.load_record(folder / f"{name}.bvh", folder / f"{name}.wav"))
    return records


def head_models() -> list[HeadModel]:
    """Return models that move the head alone."""
    rng = np.random.default_rng(SEED)
    walks = np.cumsum(rng.standard_normal((3, 1500, 3)), axis=1)
    heads = {f"talk_{k}": head.table(8.0 * np.sin(walk / 9.0), 25.0) for k, walk in enumerate(walks)}
    heard = {
        name: melody.table(name, 150.0 + rng.normal(0, 20.0, 6000), rng.normal(-30.0, 6.0, 6000), SEED)
        for name in heads
    }
    training, _ = head_fold("eda", None, heard, heads)
    session = Session(training, {}, {})
    card = {"speech": api.default_settings()["speech"], "seed": SEED, "motion_fps": 25.0}
    return [HeadModel(card, system, session.trained(system)) for system in map(installed, HEADS)]


def models() -> list[ActorModel | HeadModel]:
    """Return the models to measure."""
    found: list[ActorModel | HeadModel] = [stand_in(), api.load_model()]
    with tempfile.TemporaryDirectory() as folder:
        records = actor_records(Path(folder))
    for name in SYSTEMS:
        try:
            found.append(api.train(records, name))
        except UserError as error:
            print(f"{name} is left out: {error}")
    return [*found, *head_models()]


def chunk_s(model: ActorModel | HeadModel) -> float:
    """Return the length of the chunks in which a model hears, in seconds: its frames."""
    return melody.STEP_S if isinstance(model, HeadModel) else FRAME_S


def one_pass(model: ActorModel | HeadModel, samples: Floats) -> Floats:
    """Return the processor time of each chunk in us, without and with VMC packets, (2, chunks)."""
    hearing = engine.listening(model, RATE_HZ)
    performer = performing.performer(model, hearing, 0)
    packets = Packets(performer.body)
    output = Filled(packets)
    shown = OnBody(output) if isinstance(model, HeadModel) else output
    size = round(chunk_s(model) * RATE_HZ)
    chunks = [samples[first : first + size] for first in range(0, len(samples), size)]
    times = np.empty((2, len(chunks)))
    gc.collect()
    gc.freeze()
    for place, chunk in enumerate(chunks):
        begin = time.thread_time_ns()
        frames = [performer.step(heard) for heard in hearing.push(chunk)]
        made = time.thread_time_ns()
        for made_now in frames:
            for pose in made_now:
                shown.show(0, 0.0, pose)
        times[:, place] = made - begin, time.thread_time_ns() - begin
    gc.unfreeze()
    return times / 1000


class Filled:
    """An output that fills packets and sends none."""

    in_real_time = False

    def __init__(self, packets: Packets) -> None:
        self._packets = packets

    def show(self, frame: int, time_s: float, pose: Floats) -> None:  # noqa: ARG002
        """Fill the packets of a frame."""
        self._packets.fill(time_s, pose)

    def close(self) -> None:
        """Do nothing."""


def loopback(model: ActorModel | HeadModel, samples: Floats) -> tuple[Floats, str]:
    """Return the delay of each frame in ms, and the line about syllables."""
    ends = os.pipe()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(WAIT_S)
        arrived: list[tuple[float, float]] = []
        begun: list[float] = []
        threads = [
            threading.Thread(target=target, args=arguments)
            for target, arguments in ((speak, (ends[1], samples, begun)), (receive, (receiver, arrived)))
        ]
        source = Pipe(ends[0], Pcm(), begun_s=time.perf_counter())
        hearing = engine.listening(model, RATE_HZ)
        performer = performing.performer(model, hearing, 0)
        fps = float(model.card["motion_fps"])
        sent = Vmc(performer.body, "127.0.0.1", receiver.getsockname()[1], print)
        output = OnBody(sent) if isinstance(model, HeadModel) else sent
        running = engine.Engine(source, hearing, performer, [output], fps, print)
        for thread in threads:
            thread.start()
        running.run()
        for thread in threads:
            thread.join()
    os.close(ends[0])
    delays_ms = [1000 * (at_s - begun[0] - time_s) for time_s, at_s in arrived if 1.0 < time_s < LOOPBACK_S - 0.5]
    return np.array(delays_ms), running.syllable_delays.line("peak of a syllable until it is known")


def speak(descriptor: int, samples: Floats, begun: list[float]) -> None:
    """Write samples to a pipe when they would have been recorded."""
    data, size = sound.to_16_bit(samples).astype("<i2").tobytes(), 2 * round(BLOCK_S * RATE_HZ)
    begun.append(time.perf_counter())
    for number, first in enumerate(range(0, len(data), size), start=1):
        time.sleep(max(begun[0] + number * BLOCK_S - time.perf_counter(), 0.0))
        os.write(descriptor, data[first : first + size])
    os.close(descriptor)


def receive(receiver: socket.socket, arrived: list[tuple[float, float]]) -> None:
    """Note the time of each frame and when it arrives, until none arrives."""
    try:
        while True:
            packet = receiver.recv(2000)
            at_s = time.perf_counter()
            place = packet.find(b"/VMC/Ext/T\0")
            if place > 0:
                arrived.append((struct.unpack(">f", packet[place + 16 : place + 20])[0], at_s))
    except TimeoutError:
        return


def line(name: str, what: str, values: Floats, unit: str) -> None:
    """Print the distribution of some values."""
    numbers = "".join(f"{value:10.1f}" for value in [*np.quantile(values, [0.5, 0.9, 0.99, 0.999]), values.max()])
    print(f"{name:14} {what:26}{numbers}  {unit}")


def main() -> None:
    """Print processing times and delays of each model."""
    spoken = np.concatenate([samples for samples, _ in studio("Female2", np.random.default_rng(SEED))])
    samples = np.resize(spoken, SECONDS * RATE_HZ)
    found = models()
    print("system         what                          median        90        99      99.9   longest (%)")
    for model in found:
        engine.warm_up(model)
        name = model.system.name
        per = f"{1000 * chunk_s(model):g} ms"
        passes = np.array([one_pass(model, samples) for _ in range(3 if model.system.live else 1)])
        line(name, f"processor time per {per}", passes[0, 0], "us")
        if model.system.live:
            line(name, "best of three", passes[:, 0].min(axis=0), "us")
            line(name, "... with VMC packets", passes[:, 1].min(axis=0), "us")
        delays_ms, syllables = loopback(model, samples[: LOOPBACK_S * RATE_HZ])
        line(name, "sound to packet, loopback", delays_ms, "ms")
        if "syllables" in model.system.needs:
            print(f"{name:14} {syllables}")


if __name__ == "__main__":
    main()

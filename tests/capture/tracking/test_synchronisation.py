"""Known offsets between views are recovered from the sound; undetermined ones are rejected and not guessed."""

from fractions import Fraction

import av
import numpy as np
import pytest
import soundfile
from pictures import draw

from cospeech.capture.tracking import footage, synchronisation
from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.geometry.camera import Camera

FPS, RATE_HZ, SECONDS = 25, 16000, 8.0
BEGAN_S = {"c1": 0.9, "c2": 0.25, "c3": 1.73}
"""When each view began after the scene; the record's sound began 0.5 s after it."""

RIG = [Camera(name, (72, 48), (80, 80), (36, 24)) for name in BEGAN_S]


def scene(seed=0, seconds=12.0):
    """Return syllable-like bursts of noise at irregular times."""
    rng = np.random.default_rng(seed)
    loud = np.zeros(int(seconds * RATE_HZ))
    for start in np.cumsum(rng.uniform(0.12, 0.45, 40)):
        first = int(start * RATE_HZ)
        burst = rng.uniform(0.2, 1.0) * np.exp(-np.arange(rng.integers(800, 3200)) / 1200)
        loud[first : first + len(burst)] += burst[: max(0, len(loud) - first)]
    return 0.2 * loud * rng.normal(0, 1, len(loud))


def recorded(samples, began_s, seed, noise=0.003):
    """Return the recording of a microphone from ``began_s`` on, with its own gain and noise."""
    first = round(began_s * RATE_HZ)
    part = samples[first : first + int(SECONDS * RATE_HZ)]
    return (0.3 + 0.2 * seed) * part + np.random.default_rng(seed).normal(0, noise, len(part))


def write(path, samples, seconds=SECONDS):
    """Write a dark film with sound, AAC in MP4 or PCM in Matroska; without sound if ``samples`` is None."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mjpeg", rate=FPS)
        stream.width, stream.height, stream.pix_fmt = 72, 48, "yuvj444p"
        if samples is not None:
            voice = container.add_stream("aac" if path.suffix == ".mp4" else "pcm_s16le", rate=RATE_HZ, layout="mono")
        dark = draw((72, 48), [], noise=0)
        for _ in range(round(seconds * FPS)):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(dark, format="yuvj444p")))
        container.mux(stream.encode())
        if samples is not None:
            sound = av.AudioFrame.from_ndarray(
                (32767 * np.clip(samples, -1, 1)).astype(np.int16)[None], layout="mono"
            )
            sound.sample_rate, sound.pts, sound.time_base = RATE_HZ, 0, Fraction(1, RATE_HZ)
            container.mux(voice.encode(sound))
            container.mux(voice.encode())
    return footage.probe(path)


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    """Three films of one scene that began at ``BEGAN_S``, and the sound of the record, none of them in sync."""
    folder, samples = tmp_path_factory.mktemp("take"), scene()
    films = [
        write(folder / f"{name}{ending}", recorded(samples, began, number))
        for number, ((name, began), ending) in enumerate(zip(BEGAN_S.items(), (".mkv", ".mp4", ".mkv"), strict=True))
    ]
    soundfile.write(folder / "record.wav", recorded(samples, 0.5, 5), RATE_HZ)
    return films, folder / "record.wav"


def test_known_offsets_are_recovered_to_a_fraction_of_a_frame(take):
    films, sound = take
    table = synchronisation.offsets(films, sound, {})
    tables.validate(table, "offsets", "x")
    found = table.set_index("stream")
    for name, began in BEGAN_S.items():
        assert found.loc[name, "offset_s"] == pytest.approx(began - 0.5, abs=0.005)
    assert set(found["origin"]) == {"heard"}
    assert found.loc[list(BEGAN_S), "prominence"].min() > 3
    # All streams start with the last one, c3: views skip whole frames, the sound skips samples.
    assert found.loc["c3", "skipped_s"] == 0
    assert found.loc["sound", "skipped_s"] == pytest.approx(1.23, abs=0.005)
    ready, cameras = footage.open_take([film.path for film in films], table, RIG[::-1])
    assert cameras == RIG
    assert [film.first for film in ready] == [round(0.83 * FPS), round(1.48 * FPS), 0]
    assert footage.common_length(ready, 40) == round(SECONDS * FPS) - round(1.48 * FPS)


def test_without_the_sound_of_the_record_the_first_view_with_sound_is_the_reference(take):
    films, _ = take
    table = synchronisation.offsets(films, None, {}).set_index("stream")
    assert table["offset_s"].tolist() == pytest.approx([0.0, -0.65, 0.83], abs=0.005)


def test_films_without_sound_are_assumed_to_be_in_sync_unless_configured(tmp_path, take):
    films = [write(tmp_path / "c1.mkv", None, 2.0), write(tmp_path / "c2.mkv", np.zeros(2 * RATE_HZ), 2.0)]
    table = synchronisation.offsets(films, take[1], {})
    assert table["offset_s"].tolist() == table["skipped_s"].tolist() == [0, 0, 0]
    assert table["origin"].tolist() == ["none", "none", "heard"]
    table = synchronisation.offsets(films, None, {"c2": -0.2})
    assert table["origin"].tolist() == ["none", "given"]
    ready, _ = footage.open_take([film.path for film in films], table, RIG[:2])
    assert [(film.first, film.n_frames) for film in ready] == [(0, 2 * FPS), (5, 2 * FPS - 5)]
    with pytest.raises(UserError, match=r"c2\.mkv: the film ends before the last .* starts, 9\.00 s later"):
        synchronisation.offsets(films, None, {"c2": -9.0})


def test_undetermined_offsets_are_rejected(tmp_path, take):
    films, sound = take
    strange = write(tmp_path / "c4.mkv", recorded(scene(seed=9), 0.0, 1))
    with pytest.raises(UserError, match=r"c4\.mkv: the sound matches .*record\.wav at no clear offset"):
        synchronisation.offsets([strange], sound, {})
    clock = np.zeros(int(SECONDS * RATE_HZ))
    clock[:: RATE_HZ // 2] = 0.5  # a metronome matches at every beat
    with pytest.raises(UserError, match="at no clear offset"):
        synchronisation.offsets(
            [write(tmp_path / "c5.mkv", clock), write(tmp_path / "c6.mkv", clock[2000:])], None, {}
        )
    mute = write(tmp_path / "c7.mkv", None, 2.0)
    with pytest.raises(UserError, match=r"c7\.mkv: the film has no sound, but c1 has; set in capture\.offsets_s"):
        synchronisation.offsets([films[0], mute], sound, {})
    assert synchronisation.offsets([films[0], mute], sound, {"c7": 0.1})["origin"].tolist() == [
        "heard",
        "given",
        "heard",
    ]

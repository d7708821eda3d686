"""Video files: the same bytes every time, the colours of another program, and any sound."""

import hashlib

import av
import numpy as np
import pytest
import soundfile

from cospeech.errors import UserError
from cospeech.formats import mp4

FPS = 20.0


def test_noise_is_encoded_to_the_same_bytes_every_time(tmp_path):
    """Noise exercises every path of the encoder; with AVX-512 it gave five different files in 200 encodings."""
    drawn = np.random.default_rng(0).integers(0, 255, (40, 96, 240, 3), dtype=np.uint8)
    path = tmp_path / "noise.mp4"
    digests = set()
    for _ in range(20):
        mp4.encode(path, iter(drawn), FPS)
        digests.add(hashlib.sha256(path.read_bytes()).hexdigest())
    assert len(digests) == 1


@pytest.mark.parametrize(("rate", "channels", "seconds"), [(8000, 2, 1.0), (15000, 1, 9.0), (44100, 1, 2.5)])
def test_any_sound_becomes_mono_with_the_length_of_the_video(tmp_path, rate, channels, seconds):
    wave = 0.1 * np.sin(2 * np.pi * 300 * np.arange(int(rate * seconds)) / rate)
    soundfile.write(tmp_path / "a.wav", np.column_stack([wave] * channels), rate)
    samples, found = mp4.read_sound(tmp_path / "a.wav", 2.5)
    assert found in mp4.AAC_RATES_HZ
    assert samples.dtype == np.float32
    assert len(samples) == round(2.5 * found)
    assert not samples[round(min(seconds, 2.5) * found) :].any()
    mp4.encode(tmp_path / "a.mp4", iter([np.zeros((48, 64, 3), dtype=np.uint8)] * 50), FPS, (samples, found))
    with av.open(str(tmp_path / "a.mp4")) as film:
        heard = film.streams.audio[0]
        assert float(heard.duration * heard.time_base) == pytest.approx(2.5, abs=1 / FPS)


def test_what_is_not_sound_is_rejected(tmp_path):
    (tmp_path / "a.wav").write_bytes(b"no sound at all")
    with pytest.raises(UserError, match=r"a\.wav: cannot be read as sound"):
        mp4.read_sound(tmp_path / "a.wav", 1.0)


def test_colours_become_those_of_another_program():
    rng = np.random.default_rng(0)
    plain = np.repeat(np.repeat(rng.integers(0, 256, (8, 8, 3)), 16, 0), 16, 1).astype(np.uint8)
    whole, planes = mp4._planes(*plain.shape[:2])
    mp4.to_yuv(plain, *planes)
    other = av.VideoFrame.from_ndarray(plain, format="rgb24").reformat(
        format="yuv420p", src_colorspace="ITU709", dst_colorspace="ITU709"
    )
    light, blueness, redness = (np.frombuffer(plane, np.uint8).reshape(plane.height, -1) for plane in other.planes)
    assert np.abs(planes[0].astype(int) - light[:, :128]).max() <= 1
    middle = slice(4, None, 8)  # where the wider chroma filter of the other program covers one colour only
    assert np.abs(planes[1].astype(int) - blueness[:, :64])[middle, middle].max() <= 1
    assert np.abs(planes[2].astype(int) - redness[:, :64])[middle, middle].max() <= 1
    assert np.shares_memory(whole, planes[2])

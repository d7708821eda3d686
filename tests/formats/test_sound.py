"""Sound of any format becomes mono at 16 kHz at its original level; incomplete wav files are rejected."""

import struct

import numpy as np
import pytest
import soundfile
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.errors import UserError
from cospeech.formats import sound


def tone(rate, seconds=2.0, f0=440.0, level=0.4):
    return level * np.sin(2 * np.pi * f0 * np.arange(int(seconds * rate)) / rate)


@pytest.mark.parametrize("rate", [8000, 11025, 16000, 22050, 44100, 48000, 96000])
def test_a_tone_keeps_its_pitch_level_and_length_at_any_rate(tmp_path, rate):
    soundfile.write(tmp_path / "a.wav", tone(rate), rate, subtype="PCM_24")
    heard = sound.read(tmp_path / "a.wav")
    assert heard.delivered_hz == rate
    assert heard.duration_s == pytest.approx(2.0, abs=1e-3)
    inner = slice(1600, -1600)
    np.testing.assert_allclose(heard.samples[inner], tone(16000)[: len(heard.samples)][inner], atol=1e-3)
    said = "; ".join(heard.notes)
    assert (f"resampled from {rate} Hz" in said) == (rate != 16000)
    assert ("nothing above" in said) == (rate < 16000)


@pytest.mark.parametrize("subtype", ["PCM_U8", "PCM_16", "PCM_24", "PCM_32", "FLOAT", "DOUBLE"])
def test_every_sample_format_of_wav_is_read(tmp_path, subtype):
    soundfile.write(tmp_path / "a.wav", tone(16000), 16000, subtype=subtype)
    np.testing.assert_allclose(sound.read(tmp_path / "a.wav").samples, tone(16000), atol=0.01)


def test_channels_are_mixed_down_with_a_note(tmp_path):
    left, right = tone(16000), np.zeros(32000)
    soundfile.write(tmp_path / "a.wav", np.column_stack([left, right]), 16000)
    heard = sound.read(tmp_path / "a.wav")
    np.testing.assert_allclose(heard.samples, left / 2, atol=1e-4)
    assert heard.notes == ["2 channels mixed down to one"]


def test_an_excerpt_is_cut_at_its_samples(tmp_path):
    ramp = np.linspace(-0.5, 0.5, 32000)
    soundfile.write(tmp_path / "a.wav", ramp, 16000, subtype="DOUBLE")
    heard = sound.read(tmp_path / "a.wav", 0.25, 1.5)
    np.testing.assert_array_equal(heard.samples, ramp[4000:24000])
    np.testing.assert_array_equal(sound.read(tmp_path / "a.wav", 0.25).samples, ramp[4000:])
    for start, end in ((0.0, 2.5), (2.0, None), (3.0, 4.0)):
        with pytest.raises(UserError, match=r"a\.wav: lasts 2.000 s.*start_s"):
            sound.read(tmp_path / "a.wav", start, end)


def test_too_loud_floats_are_clipped_with_a_note(tmp_path):
    soundfile.write(tmp_path / "a.wav", tone(16000, level=1.5), 16000, subtype="FLOAT")
    heard = sound.read(tmp_path / "a.wav")
    assert np.abs(heard.samples).max() == 1
    assert "clipped" in heard.notes[0]


def whole_wav():
    import io

    file = io.BytesIO()
    soundfile.write(file, tone(16000, 0.2), 16000, format="WAV")
    return file.getvalue()


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is empty"),
        (whole_wav()[:2000], "announces 6400 bytes of sound and holds 1956"),
        (whole_wav()[:40], "no sound"),
        (whole_wav()[:14], "no sound"),
        (b"ID3\x04\x00 an mp3", "not a wav file"),
        (b"HIERARCHY\nROOT Hips", "not a wav file"),
        (b"RIFF\x24\x00\x00\x00AVI LIST", "not a wav file"),
        (whole_wav()[:40] + struct.pack("<I", 0), "holds no sound"),
        (whole_wav()[:20] + b"\x99\x99" + whole_wav()[22:], "cannot be read as wav"),
    ],
)
def test_a_broken_wav_ends_in_one_line_that_names_it(tmp_path, content, says):
    (tmp_path / "bad.wav").write_bytes(content)
    with pytest.raises(UserError, match=says) as caught:
        sound.read(tmp_path / "bad.wav")
    assert "bad.wav" in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_missing_silent_and_undefined_sound_is_rejected(tmp_path):
    with pytest.raises(UserError, match=r"none\.wav: cannot be read"):
        sound.read(tmp_path / "none.wav")
    soundfile.write(tmp_path / "silent.wav", np.zeros(16000), 16000)
    with pytest.raises(UserError, match=r"silent\.wav: is silent"):
        sound.read(tmp_path / "silent.wav")
    broken = tone(16000)
    broken[8000] = np.nan
    soundfile.write(tmp_path / "nan.wav", broken, 16000, subtype="FLOAT")
    with pytest.raises(UserError, match=r"nan\.wav: holds NaN at 0.500 s"):
        sound.read(tmp_path / "nan.wav")
    soundfile.write(tmp_path / "low.wav", tone(2000), 2000)
    with pytest.raises(UserError, match="2000 Hz is not a sampling rate of recorded speech"):
        sound.read(tmp_path / "low.wav")


def test_what_is_written_is_16_bit_mono_and_the_same_bytes_every_time(tmp_path):
    for name in "ab":
        sound.write(tone(16000), tmp_path / f"{name}.wav")
    assert (tmp_path / "a.wav").read_bytes() == (tmp_path / "b.wav").read_bytes()
    info = soundfile.info(tmp_path / "a.wav")
    assert (info.samplerate, info.channels, info.subtype) == (16000, 1, "PCM_16")
    np.testing.assert_allclose(sound.read(tmp_path / "a.wav").samples, tone(16000), atol=1 / 32768)


@settings(max_examples=120, deadline=None)
@given(st.data())
def test_a_corrupt_wav_is_read_or_rejected_and_nothing_else(tmp_path_factory, data):
    content = bytearray(whole_wav())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, 60))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.mktemp("wav") / "spoilt.wav"
    path.write_bytes(content[: data.draw(st.integers(0, len(content)) | st.just(len(content)))])
    try:
        heard = sound.read(path)
    except UserError:
        return
    assert np.isfinite(heard.samples).all()
    assert np.abs(heard.samples).max() <= 1

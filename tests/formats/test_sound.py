"""Sound of any format becomes mono at 16 kHz at its original level; incomplete wav files are rejected."""

import struct

import numpy as np
import pytest
import soundfile
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.errors import UserError
from cospeech.formats import audio, sound


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
    ramp = np.arange(-16000, 16000) / 32768
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
        (whole_wav()[:40] + struct.pack("<I", 0), "contains no sound"),
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
    with pytest.raises(UserError, match=r"nan\.wav: contains NaN or infinity at 0.500 s"):
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


def talk(seed, seconds=12.0, rate=16000):
    """Noise with the rhythm of speech: syllables of different loudness, and pauses 50 dB below them."""
    draw = np.random.default_rng(seed)
    level_db = np.repeat(draw.uniform(-14, 0, round(seconds * 4)), rate // 4)
    syllables = np.abs(np.sin(4 * np.pi * np.arange(len(level_db)) / rate))
    speaks = np.repeat(draw.random(round(seconds)) < 0.7, rate)
    return 10 ** (level_db / 20) * syllables * speaks * draw.normal(0, 0.1, len(level_db)) + draw.normal(
        0, 3e-4, len(level_db)
    )


def turns(rate=16000):
    """Two speakers who take turns, with 14 dB of crosstalk."""
    first, second = talk(1), talk(2)
    speaks = np.arange(len(first)) // (3 * rate) % 2 == 0
    one, two = first * speaks, second * ~speaks
    return np.column_stack([one + 0.2 * two, two + 0.2 * one])


def late(samples, delay, gain):
    return gain * np.concatenate([np.zeros(delay), samples[: len(samples) - delay]])


DRAW = np.random.default_rng(3)
SAME = {
    "twice": np.column_stack([talk(1), talk(1)]),
    "softer": np.column_stack([talk(1), 0.2 * talk(1)]),
    "later": np.column_stack([talk(1), late(talk(1), 40, 0.7)]),
    "noisier": np.column_stack([talk(1), 0.5 * talk(1) + DRAW.normal(0, 3e-3, len(talk(1)))]),
    "one is silent": np.column_stack([talk(1), np.zeros(len(talk(1)))]),
    "one is soft noise": np.column_stack([talk(1), DRAW.normal(0, 3e-4, len(talk(1)))]),
    "both are noise": DRAW.normal(0, 0.1, (16000 * 3, 2)),
    "both offset": np.column_stack([talk(1) + 0.05, talk(1) - 0.05]),
    "six": np.column_stack([talk(1) * gain for gain in (1, 0.9, 0.8, 0.5, 0, 0.3)]),
}
DIFFERENT = {
    "turns": (turns(), "channels 1 and 2 contain different speech"),
    "at the same time": (np.column_stack([talk(1), talk(2)]), "channels 1 and 2 contain different speech"),
    "the third of three": (np.column_stack([talk(1), talk(1), talk(2)]), "channels 1 and 3 contain different speech"),
    "a time code": (
        np.column_stack([np.sign(tone(16000, 12.0, 1000)) / 8, talk(1)]),
        "channels 1 and 2 contain speech and a constant noise",
    ),
    "inverted": (np.column_stack([talk(1), -0.9 * talk(1)]), "channels cancel each other"),
}


@pytest.mark.parametrize("channels", SAME.values(), ids=SAME.keys())
def test_channels_of_one_recording_are_mixed_down(tmp_path, channels):
    soundfile.write(tmp_path / "a.wav", channels, 16000, subtype="PCM_16")
    heard = sound.read(tmp_path / "a.wav")
    np.testing.assert_allclose(heard.samples, channels.mean(axis=1), atol=2 / 32768)
    assert heard.notes == [f"{channels.shape[1]} channels mixed down to one"]


@pytest.mark.parametrize(("channels", "complaint"), DIFFERENT.values(), ids=DIFFERENT.keys())
@pytest.mark.parametrize("read", [sound.read, audio.read])
def test_channels_that_must_not_be_mixed_down_have_to_be_chosen(tmp_path, channels, complaint, read):
    soundfile.write(tmp_path / "a.wav", channels, 16000, subtype="PCM_16")
    with pytest.raises(UserError, match=rf"a\.wav: its {complaint}.*; choose one of 1 to {channels.shape[1]} "):
        read(tmp_path / "a.wav")
    for channel in range(1, channels.shape[1] + 1):
        heard = read(tmp_path / "a.wav", channel=channel)
        np.testing.assert_allclose(heard.samples, channels[:, channel - 1], atol=1 / 32768)
        assert heard.notes == [f"only channel {channel} used"]


def test_a_corpus_mixes_down_different_speakers_with_a_warning(tmp_path):
    channels, complaint = DIFFERENT["turns"]
    soundfile.write(tmp_path / "a.wav", channels, 16000, subtype="PCM_16")
    heard = sound.read(tmp_path / "a.wav", mix_different=True)
    np.testing.assert_allclose(heard.samples, channels.mean(axis=1), atol=2 / 32768)
    assert heard.notes == [f"2 channels mixed down to one, although {complaint}: set the channel of the record"]


def test_only_the_excerpt_and_the_chosen_channel_matter(tmp_path):
    channels = np.concatenate([turns(), np.column_stack([talk(1), talk(1)])])
    channels[100, 1] = np.nan
    soundfile.write(tmp_path / "a.wav", channels, 16000, subtype="FLOAT")
    assert sound.read(tmp_path / "a.wav", 12.0).notes == ["2 channels mixed down to one"]
    assert sound.read(tmp_path / "a.wav", channel=1).notes == ["only channel 1 used"]
    with pytest.raises(UserError, match=r"a\.wav: contains NaN or infinity at 0\.006 s"):
        sound.read(tmp_path / "a.wav", channel=2)
    with pytest.raises(UserError, match=r"a\.wav: has 2 channel\(s\), so there is no channel 3"):
        sound.read(tmp_path / "a.wav", channel=3)


def test_an_offset_and_a_clipped_recording_are_noted(tmp_path):
    soundfile.write(tmp_path / "a.wav", tone(16000) + 0.05, 16000)
    assert sound.read(tmp_path / "a.wav").notes == [
        "constant offset of 5.0 % of full scale, which the features ignore"
    ]
    overdriven = tone(16000, level=2.0)
    soundfile.write(tmp_path / "a.wav", np.clip(overdriven, -1, 1), 16000, subtype="PCM_16")
    n_clipped = (np.abs(overdriven) >= 1 - 1 / 32768).sum()
    assert sound.read(tmp_path / "a.wav").notes == [f"{n_clipped} samples at full scale: recorded too loud"]


@pytest.mark.parametrize("read", [sound.read, audio.read])
@pytest.mark.parametrize(
    ("samples", "complaint"),
    [
        (np.full(16000, 0.05), "is silent"),
        (tone(16000) * 32768, "exceed 16 times full scale"),
        (np.zeros((160, 65)), "has 65 channels"),
    ],
)
def test_sound_that_cannot_be_speech_is_rejected(tmp_path, samples, complaint, read):
    soundfile.write(tmp_path / "a.wav", samples, 16000, subtype="FLOAT")
    with pytest.raises(UserError, match=rf"a\.wav: .*{complaint}"):
        read(tmp_path / "a.wav")


@pytest.mark.parametrize("read", [sound.read, audio.read])
def test_hours_are_read_up_to_a_limit(tmp_path, monkeypatch, read):
    monkeypatch.setattr(sound, "LONGEST_S", 2)
    soundfile.write(tmp_path / "a.wav", tone(8000, 2.0), 8000)
    assert read(tmp_path / "a.wav").duration_s == pytest.approx(2.0)
    soundfile.write(tmp_path / "a.wav", tone(8000, 20.0), 8000)
    with pytest.raises(UserError, match=r"a\.wav: lasts more than 0\.0\d* hours; cut it"):
        read(tmp_path / "a.wav")


KINDS = [
    ("WAV", "ULAW"),
    ("WAV", "ALAW"),
    ("WAVEX", "PCM_24"),
    ("WAVEX", "FLOAT"),
    ("RF64", "PCM_16"),
    ("RIFX", "PCM_24"),
]


@pytest.mark.parametrize(("kind", "subtype"), KINDS)
def test_every_kind_of_wav_is_read_alike_and_rejected_if_truncated(tmp_path, kind, subtype):
    form, endian = ("WAV", "BIG") if kind == "RIFX" else (kind, "FILE")
    soundfile.write(tmp_path / "a.wav", tone(16000), 16000, subtype=subtype, format=form, endian=endian)
    content = (tmp_path / "a.wav").read_bytes()
    assert content[:4].decode() == {"RF64": "RF64", "RIFX": "RIFX"}.get(kind, "RIFF")
    by_both = [read(tmp_path / "a.wav") for read in (sound.read, audio.read)]
    np.testing.assert_array_equal(by_both[0].samples, by_both[1].samples)
    np.testing.assert_allclose(by_both[0].samples, tone(16000), atol=0.02)
    assert by_both[0].notes == by_both[1].notes == []
    (tmp_path / "a.wav").write_bytes(content[: len(content) // 2])
    for read in (sound.read, audio.read):
        with pytest.raises(UserError, match=r"a\.wav: announces \d+ bytes of sound and holds \d+; copy it again"):
            read(tmp_path / "a.wav")


@pytest.mark.parametrize("read", [sound.read, audio.read])
def test_a_wav_from_a_pipe_is_read_and_one_whose_recording_was_interrupted_is_not(tmp_path, read):
    content = bytearray(whole_wav())
    content[4:8] = content[40:44] = b"\xff\xff\xff\xff"
    (tmp_path / "a.wav").write_bytes(content)
    np.testing.assert_allclose(read(tmp_path / "a.wav").samples, tone(16000, 0.2), atol=1 / 32768)
    content[40:44] = bytes(4)
    (tmp_path / "a.wav").write_bytes(content)
    with pytest.raises(UserError, match=r"a\.wav: announces no sound and holds 6400 bytes"):
        read(tmp_path / "a.wav")

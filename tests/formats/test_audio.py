"""Sound of any format arrives as mono sound at 16 kHz, with the samples that the audio of a record has."""

from fractions import Fraction

import av
import numpy as np
import pytest
import soundfile
import soxr
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.errors import UserError
from cospeech.formats import audio, sound

RATES_HZ = (8000, 16000, 22050, 44100, 48000)
SUBTYPES = ("PCM_U8", "PCM_16", "PCM_24", "PCM_32", "FLOAT", "DOUBLE")


def tone(rate, seconds=1.0, f0=440.0, level=0.4):
    return level * np.sin(2 * np.pi * f0 * np.arange(round(seconds * rate)) / rate)


def encode(path, codec, samples, rate, picture=False):
    """Write mono sound with an encoder of FFmpeg, next to a black picture if ``picture``."""
    with av.open(str(path), "w") as container:
        if picture:
            film = container.add_stream("libx264", rate=10)
            film.width, film.height, film.pix_fmt = 64, 64, "yuv420p"
        stream = container.add_stream(codec, rate=rate, layout="mono")
        resampler = av.AudioResampler(format=stream.format, layout="mono", rate=rate)
        frame = av.AudioFrame.from_ndarray(samples[None].astype(np.float32), format="flt", layout="mono")
        frame.sample_rate, frame.pts, frame.time_base = rate, 0, Fraction(1, rate)
        if picture:
            for _ in range(10):
                container.mux(film.encode(av.VideoFrame.from_ndarray(np.zeros((64, 64, 3), np.uint8))))
            container.mux(film.encode(None))
        for part in [*resampler.resample(frame), None]:
            container.mux(stream.encode(part))


@pytest.fixture
def as_record(tmp_path):
    """The samples of a wav file after the workflow has read it and written it as the audio of a record."""

    def read(path):
        sound.write(sound.read(path).samples, tmp_path / "record.wav")
        return soundfile.read(tmp_path / "record.wav")[0]

    return read


@pytest.mark.parametrize("subtype", SUBTYPES)
@pytest.mark.parametrize("rate", RATES_HZ)
def test_a_wav_gives_the_samples_of_a_record_to_the_bit(tmp_path, as_record, rate, subtype):
    noisy = np.random.default_rng(rate).normal(0, 0.3, (3 * rate, 2))
    soundfile.write(tmp_path / "a.wav", noisy, rate, subtype=subtype)
    np.testing.assert_array_equal(audio.read(tmp_path / "a.wav").samples, as_record(tmp_path / "a.wav"))
    assert audio.read(tmp_path / "a.wav").notes == sound.read(tmp_path / "a.wav").notes


def test_the_audio_of_a_record_is_read_as_it_is_up_to_full_scale(tmp_path):
    steps = np.arange(-32768, 32768, dtype=np.int16)
    soundfile.write(tmp_path / "a.wav", steps, 16000, subtype="PCM_16")
    for read in (audio.read, sound.read):
        samples = read(tmp_path / "a.wav").samples
        np.testing.assert_array_equal(samples * 32768, steps)
        np.testing.assert_array_equal(sound.to_16_bit(samples), steps)


FORMATS = {"a.flac": "flac", "a.mp3": "libmp3lame", "a.m4a": "aac", "a.ogg": "libopus", "a.mp4": "aac"}
OPUS_RATES_HZ = (8000, 16000, 48000)


@pytest.mark.parametrize(
    ("name", "codec", "rate"),
    [(*form, rate) for form in FORMATS.items() for rate in (OPUS_RATES_HZ if "opus" in form[1] else RATES_HZ)],
)
def test_a_tone_in_other_formats_keeps_its_pitch_level_and_length(tmp_path, name, codec, rate):
    encode(tmp_path / name, codec, tone(rate), rate, picture=name.endswith("mp4"))
    heard = audio.read(tmp_path / name)
    # Lossy formats are padded to whole frames of at most 2048 samples at either end.
    assert -0.001 <= heard.duration_s - 1 <= 2 * 2048 / rate
    inner = heard.samples[4800:12800]
    # The level of a tone is its power: the AAC encoder of FFmpeg 8 leaves a burst of a few samples.
    assert np.sqrt(2 * np.mean(inner**2)) == pytest.approx(0.4, rel=0.1)
    assert np.argmax(np.abs(np.fft.rfft(inner))) * 2 == pytest.approx(440, abs=2)


@pytest.mark.parametrize("rate", [8000, 11025, 22050, 44100, 48000, 96000])
def test_resampling_piece_by_piece_and_at_once_are_the_same(rate):
    noisy = np.random.default_rng(0).normal(0, 0.2, 200_001)
    pieces = np.split(noisy, [1, 77, 1000, 70_000, 199_999])
    np.testing.assert_array_equal(
        sound.mixed("a", (piece[:, None] for piece in pieces), rate, 1).samples * 32768,
        sound.to_16_bit(soxr.resample(noisy, rate, 16000, quality="VHQ")),
    )


@settings(max_examples=60, deadline=None)
@given(rate=st.sampled_from(RATES_HZ), length=st.integers(100, 20_000))
def test_the_length_is_that_of_the_file(tmp_path_factory, rate, length):
    path = tmp_path_factory.mktemp("length") / "a.wav"
    soundfile.write(path, tone(rate, length / rate), rate)
    assert len(audio.read(path).samples) == pytest.approx(length / rate * 16000, abs=1)
    assert len(audio.read(path).samples) == len(sound.read(path).samples)


def test_channels_are_mixed_or_chosen(tmp_path):
    left, right = tone(16000), tone(16000, f0=880)
    soundfile.write(tmp_path / "a.wav", np.column_stack([left, right]), 16000, subtype="FLOAT")
    for channel, expected, note in (
        (None, (left + right) / 2, "2 channels mixed down to one"),
        (1, left, "only channel 1 used"),
        (2, right, "only channel 2 used"),
    ):
        heard = audio.read(tmp_path / "a.wav", channel)
        np.testing.assert_allclose(heard.samples, expected, atol=2 / 32768)
        assert heard.notes == [note]
    for channel in (0, 3):
        with pytest.raises(UserError, match=rf"a\.wav: has 2 channel\(s\), so there is no channel {channel}"):
            audio.read(tmp_path / "a.wav", channel)


def test_too_loud_sound_is_clipped_and_it_is_noted(tmp_path):
    soundfile.write(tmp_path / "a.wav", tone(16000, level=1.5), 16000, subtype="FLOAT")
    heard = audio.read(tmp_path / "a.wav")
    assert (heard.samples.max(), heard.samples.min()) == (32767 / 32768, -1)
    assert heard.notes == [f"{(np.abs(tone(16000, level=1.5)) > 1).sum()} samples clipped at full scale"]


def silent_film(path):
    with av.open(str(path), "w") as container:
        film = container.add_stream("libx264", rate=10)
        film.width, film.height, film.pix_fmt = 64, 64, "yuv420p"
        container.mux(film.encode(av.VideoFrame.from_ndarray(np.zeros((64, 64, 3), np.uint8))))
        container.mux(film.encode(None))


def write(samples, rate=16000):
    return lambda path: soundfile.write(path, samples, rate, format="WAV", subtype="FLOAT")


def broken(value):
    samples = tone(16000)
    samples[8000] = value
    return samples


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda path: None, "no such file"),
        (lambda path: path.mkdir(), "is a folder"),
        (lambda path: path.write_bytes(b""), "is empty"),
        (lambda path: path.write_bytes(b"RIFF"), "cannot be decoded as sound"),
        (lambda path: path.write_bytes(bytes(range(256)) * 40), "cannot be decoded as sound"),
        (lambda path: path.write_text("HIERARCHY\nROOT hips\n" * 100), "cannot be decoded as sound"),
        (lambda path: path.write_text("#EXTM3U\nhttp://localhost/a.wav\n"), "cannot be decoded as sound"),
        (silent_film, "contains no sound; name a file with speech"),
        (write(np.zeros(0)), "cannot be decoded as sound|contains no sound"),
        (write(np.zeros(16000)), "is silent"),
        (write(np.full(16000, 1 / 32768)), "is silent"),
        (write(broken(np.nan)), r"contains NaN or infinity at 0\.500 s"),
        (write(broken(np.inf)), r"contains NaN or infinity at 0\.500 s"),
        (write(tone(2000), 2000), "2000 Hz is not a sampling rate of recorded speech"),
    ],
)
def test_what_is_not_sound_is_refused_in_one_line(tmp_path, make, complaint):
    path = tmp_path / "10:30 bad.mp4"
    make(path)
    with pytest.raises(UserError, match=complaint) as caught:
        audio.read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert len(str(caught.value).splitlines()) == 1


def test_a_name_may_look_like_an_address(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    soundfile.write("http:a.wav", tone(16000), 16000)
    assert len(audio.read("http:a.wav").samples) == 16000


@pytest.mark.parametrize("name", ["a.flac", "a.aiff", "a.au"])
def test_a_truncated_file_is_rejected(tmp_path, name):
    soundfile.write(tmp_path / name, tone(16000, 4.0), 16000, subtype="PCM_16")
    content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(content[: len(content) * 2 // 3])
    with pytest.raises(UserError, match=rf"{name}: (announces 4\.000 s of sound|cannot be decoded)"):
        audio.read(tmp_path / name)

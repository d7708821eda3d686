"""Sources of sound: a pipe with samples of any format, a file, a microphone."""

import os
import sys
import types

import numpy as np
import pytest
import soundfile

from cospeech.errors import UserError
from cospeech.formats import audio
from cospeech.live import sound


@pytest.fixture
def pipe():
    """Both ends of a pipe."""
    ends = list(os.pipe())
    yield ends
    for end in ends:
        if end is not None:
            os.close(end)


def read_all(source):
    pieces = []
    while (piece := source.read(1.0)) is not None:
        pieces.append(piece)
    return np.concatenate(pieces)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("16000", (16000, "s16le", 1)),
        ("48000:f32le", (48000, "f32le", 1)),
        ("44100:s32be:2", (44100, "s32be", 2)),
    ],
)
def test_formats_of_samples(text, expected):
    assert sound.parse_pcm(text) == expected


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "'' is not a sampling rate from 4000 to 768000 Hz"),
        ("16k", "'16k' is not a sampling rate"),
        ("100", "'100' is not a sampling rate"),
        ("16000:mp3", "unknown format 'mp3'; known are u8, s16le"),
        ("16000:s16le:0", "0 channels; from 1 to 64"),
        ("16000:s16le:two", "is not RATE:FORMAT:CHANNELS"),
        ("16000:s16le:1:2", "is not RATE:FORMAT:CHANNELS"),
    ],
)
def test_a_wrong_format_is_refused(text, complaint):
    with pytest.raises(UserError, match=complaint):
        sound.parse_pcm(text)


@pytest.mark.parametrize("encoding", sound.ENCODINGS)
@pytest.mark.parametrize("n_bytes", [1, 7, 4096])
def test_samples_of_every_format_arrive_in_pieces_of_any_length(pipe, encoding, n_bytes):
    values = np.array([[0.5, -0.25], [-1.0, 0.0], [0.75, -0.5], [0.0, 0.25]])
    kind, full_scale = sound.ENCODINGS[encoding]
    scaled = values * full_scale + (full_scale if kind == "u1" else 0)
    data = scaled.astype(kind).tobytes()
    mixed, second = (sound.Pipe(pipe[0], sound.Pcm(16000, encoding, 2), channel) for channel in (None, 2))
    for source, expected in ((mixed, values.mean(axis=1)), (second, values[:, 1])):
        heard = []
        for first in range(0, len(data), n_bytes):
            os.write(pipe[1], data[first : first + n_bytes])
            heard.append(source.read(1.0))
        np.testing.assert_array_equal(np.concatenate(heard), expected)
    assert len(mixed.read(0.0)) == 0  # nothing has arrived
    os.write(pipe[1], data[: len(data) // 4 + 1])  # the last sample is cut
    os.close(pipe[1])
    pipe[1] = None
    np.testing.assert_array_equal(read_all(mixed), [0.125])
    assert mixed.read(0.0) is None


def test_bytes_of_any_kind_are_samples(pipe):
    """A signalling NaN is a NaN like others."""
    os.write(pipe[1], bytes.fromhex("0100a07f") + np.array([0.5, np.inf], dtype="<f4").tobytes())
    np.testing.assert_array_equal(sound.Pipe(pipe[0], sound.Pcm(16000, "f32le")).read(1.0), [np.nan, 0.5, np.inf])


def test_a_channel_that_the_sound_does_not_have_is_refused():
    with pytest.raises(UserError, match=r"--channel 3: the sound has 2"):
        sound.Pipe(0, sound.Pcm(16000, "s16le", 2), 3)


def test_a_file_has_the_samples_of_the_recording(recordings, tmp_path):
    source = sound.File(recordings / "speech.wav")
    np.testing.assert_array_equal(read_all(source), audio.read(recordings / "speech.wav").samples)
    speech = soundfile.read(recordings / "speech.wav")[0]
    soundfile.write(tmp_path / "fast.wav", np.column_stack([np.repeat(speech, 3), np.zeros(3 * len(speech))]), 48000)
    source = sound.File(tmp_path / "fast.wav", 1)
    assert any("resampled from 48000 Hz" in line for line in source.notes)
    np.testing.assert_array_equal(read_all(source), audio.read(tmp_path / "fast.wav", 1).samples)
    with pytest.raises(UserError, match=r"none.wav: no such file"):
        sound.File(tmp_path / "none.wav")


class Device:
    """A microphone as sounddevice shows it, which delivers three blocks at once."""

    def __init__(self, samplerate, blocksize, device, channels, dtype, callback):
        assert (samplerate, blocksize, channels, dtype) == (16000, 160, 1, "float32")
        if device == "broken":
            raise ValueError("No input device matching 'broken'")
        self.device, self.callback = device, callback
        self.closed = False

    def start(self):
        for number in range(3):
            self.callback(np.full((160, 1), number / 4, dtype=np.float32), 160, None, None)

    def close(self):
        self.closed = True


@pytest.fixture
def sounddevice(monkeypatch):
    module = types.ModuleType("sounddevice")
    module.InputStream, module.PortAudioError = Device, type("PortAudioError", (Exception,), {})
    monkeypatch.setitem(sys.modules, "sounddevice", module)


def test_a_microphone_delivers_its_blocks_and_counts_those_that_nobody_fetches(sounddevice, monkeypatch):
    microphone = sound.Microphone("2")
    assert microphone._stream.device == 2
    assert microphone._blocks.empty()  # it does not listen before it is read
    assert [float(microphone.read(0.0)[0]) for _ in range(3)] == [0.0, 0.25, 0.5]
    assert len(microphone.read(0.0)) == 0
    microphone.close()
    assert microphone._stream.closed
    monkeypatch.setattr(sound, "QUEUE_S", 0.02)
    microphone = sound.Microphone()
    assert len(microphone.read(0.0)) == 160
    assert microphone.n_lost == 1


def test_a_microphone_that_is_missing_takes_one_line(sounddevice, monkeypatch):
    with pytest.raises(UserError, match=r"cannot be opened .*'broken'.*; 'python -m sounddevice' lists the devices"):
        sound.Microphone("broken")
    monkeypatch.setitem(sys.modules, "sounddevice", None)
    with pytest.raises(UserError, match=r"pip install 'cospeech\[microphone\]'"):
        sound.Microphone()

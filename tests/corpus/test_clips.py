"""Sheets of a user's own films: what they say is read, and lines that cannot be used are reported one by one."""

from fractions import Fraction

import av
import numpy as np
import pytest
import soundfile

from cospeech.corpus import clips
from cospeech.data import tables
from cospeech.errors import UserError

HEADER = "file,speaker,phrase,session\n"


def write_film(path, fps=15, sound=True, n_frames=6):
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mjpeg", rate=Fraction(fps))
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuvj420p"
        track = container.add_stream("pcm_s16le", rate=16000, layout="mono") if sound else None
        for number in range(n_frames):
            frame = av.VideoFrame.from_ndarray(np.full((48, 64, 3), 40 * number, dtype=np.uint8), "rgb24")
            frame.pts, frame.time_base = number, Fraction(1, fps)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
        if track is not None:
            samples = np.zeros((1, round(16000 * n_frames / fps)), dtype=np.int16)
            piece = av.AudioFrame.from_ndarray(samples, "s16", "mono")
            piece.sample_rate = 16000
            container.mux(track.encode(piece))
            container.mux(track.encode())


@pytest.fixture(scope="module")
def films(tmp_path_factory):
    folder = tmp_path_factory.mktemp("films")
    for name in ("a", "b", "c"):
        write_film(folder / f"{name}.mkv")
    write_film(folder / "fast.mkv", fps=25)
    write_film(folder / "slow.mkv", fps=5)
    write_film(folder / "silent.mkv", sound=False)
    soundfile.write(folder / "voice.wav", np.zeros(8000), 16000)
    (folder / "broken.mkv").write_bytes(b"no film at all")
    return folder


def read(films, text):
    (films / "sheet.csv").write_text(text, encoding="utf-8")
    return clips.read(films / "sheet.csv")


def test_a_sheet_is_read(films):
    sheet = read(
        films,
        "file,speaker,phrase,session,mouth_x_px,mouth_y_px\n"
        "a.mkv,ayla,Ayla Can,1,30,24.5\nb.mkv,ayla,Ayla Can,2,,\nc.mkv,ayla,Umut Er,,,\n",
    )
    assert sheet.notes == []
    tables.validate(sheet.clips, "clips", "x")
    tables.validate(sheet.mouths, "mouths", "x")
    assert sheet.clips["clip"].tolist() == ["a", "b", "c"]
    assert sheet.clips["repetition"].tolist() == [0, 1, 0]
    assert sheet.clips["session"].tolist()[:2] == ["session1", "session2"]
    assert sheet.clips["own_name"].tolist() == [True, True, False]
    assert sheet.clips["fps"].tolist() == [15.0] * 3
    assert sheet.clips["duration_s"].tolist() == pytest.approx([0.4] * 3, abs=0.02)
    assert sheet.mouths.to_dict("records") == [{"clip": "a", "x_px": 30.0, "y_px": 24.5}]


def test_unknown_speakers_say_nobody_s_name_and_sound_may_be_a_file_of_its_own(films):
    sheet = read(films, "file,speaker,phrase,session,sound\nsilent.mkv,,Ayla Can,,voice.wav\n")
    assert sheet.clips["speaker"].isna().all()
    assert sheet.clips["own_name"].tolist() == [False]
    assert sheet.clips["sound"].iloc[0].endswith("voice.wav")
    tables.validate(sheet.clips, "clips", "x")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("silent.mkv,ayla,Ayla Can,1", "silent.mkv: has no sound; name its sound file in column 'sound'"),
        ("voice.wav,ayla,Ayla Can,1", "voice.wav: contains sound without a film; name a film of the speaking face"),
        ("a.mkv,ayla,Ayla Can,1", "line 2 names a.mkv, too; delete one of them"),
        ("b.mkv,ayla,Ayla Can,evening", "unknown session 'evening'; number the sessions from 1 to 99, or leave"),
        ("gone.mkv,ayla,Ayla Can,1", "gone.mkv: no such file; correct the path"),
        ("broken.mkv,ayla,Ayla Can,1", "broken.mkv: cannot be read as a film ("),
        ("slow.mkv,ayla,Ayla Can,1", "slow.mkv: has 5 frames per second; lips need 8 or more"),
        ("b.mkv,ayla,,1", "it needs a file and a phrase; complete it"),
    ],
)
def test_a_line_that_cannot_be_used_is_reported_and_the_others_go_on(films, line, message):
    sheet = read(films, f"{HEADER}a.mkv,ayla,Ayla Can,1\n{line}\nc.mkv,ayla,Ayla Can,2\n")
    assert sheet.clips["clip"].tolist() == ["a", "c"]
    assert len(sheet.notes) == 1
    assert sheet.notes[0].startswith(f"{films / 'sheet.csv'}: line 3 is left out: ")
    assert message in sheet.notes[0]


def test_the_files_of_a_sheet_are_those_that_exist(films):
    sheet = films / "some.csv"
    sheet.write_text(
        "file,speaker,phrase,session,sound\na.mkv,x,X,,\nnone.mkv,x,X,,\nb.mkv,x,X,,a.mkv\n", encoding="utf-8"
    )
    assert clips.files(sheet) == [str(films / "a.mkv"), str(films / "b.mkv")]
    assert clips.files(films / "none.csv") == []


def test_different_frame_rates_are_noted(films):
    sheet = read(films, f"{HEADER}a.mkv,ayla,Ayla Can,1\nfast.mkv,ayla,Ayla Can,1\n")
    assert len(sheet.clips) == 2
    assert "films have different frame rates (1 at 15, 1 at 25 per second)" in sheet.notes[0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("file,speaker,phrase\na.mkv,x,y\n", "column 'session' is missing; columns file, speaker, phrase, session"),
        ("file,speaker,phrase,sesion\na.mkv,x,y,1\n", "unknown column 'sesion'; did you mean 'session'?"),
        (f"{HEADER}gone.mkv,x,y,1\n", "names no film that can be used; line 2 is left out: "),
    ],
)
def test_a_sheet_that_cannot_be_used_is_refused(films, text, message):
    with pytest.raises(UserError) as caught:
        read(films, text)
    assert message in str(caught.value)


@pytest.mark.parametrize("cells", ["12,", "x,4", "-3,5"])
def test_a_mouth_without_two_numbers_is_reported(films, cells):
    sheet = read(films, f"file,speaker,phrase,session,mouth_x_px,mouth_y_px\na.mkv,x,y,1,,\nb.mkv,x,y,1,{cells}\n")
    assert "line 3 is left out: mouth_x_px and mouth_y_px are" in sheet.notes[0]

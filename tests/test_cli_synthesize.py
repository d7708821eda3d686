"""``cospeech synthesize``: what it writes, and how it fails."""

import itertools
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import pytest
import soundfile

from cospeech import api, cli
from cospeech.commands import synthesize
from cospeech.data import tables
from cospeech.formats import bvh, sound, textgrid
from cospeech.workflow import model_folder

QUICK = "bvh,table,textgrid"
BUNDLED = "cospeech: using the bundled model, which was learned from a virtual actor and not from people"


class Ended:
    """How a call ended: exit status, lines on stdout and stderr."""

    def __init__(self, status, printed):
        self.status = status
        self.out, self.err = printed.out.splitlines(), printed.err.splitlines()


@pytest.fixture
def call(capsys, monkeypatch, recordings, tmp_path):
    """Run the command in an empty folder with a copy of speech.wav."""
    shutil.copy(recordings / "speech.wav", tmp_path)
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        capsys.readouterr()
        try:
            status = cli.main(["synthesize", *map(str, arguments)])
        except SystemExit as ended:
            status = ended.code
        return Ended(status, capsys.readouterr())

    return run


def files():
    """Every file and folder below the current one, hidden ones too, but for the sound."""
    found = (str(path) for path in Path().rglob("*"))
    return {path for path in found if path != "speech.wav"}


def test_one_call_writes_motion_table_video_and_phrases(call):
    ended = call("speech.wav")
    written = ["speech.bvh", "speech.motion.parquet", "speech.mp4", "speech.TextGrid"]
    assert (ended.status, ended.out, ended.err) == (0, written, [BUNDLED])
    assert files() == set(written)
    clip = bvh.read("speech.bvh")
    assert (len(clip.rotations), clip.fps) == (250, 25.0)
    assert len(tables.read("speech.motion.parquet", "motion")) == 250
    assert tables.read_metadata("speech.motion.parquet")["corpus"] == "virtual"
    ((_, spans),) = textgrid.read("speech.TextGrid").tiers
    assert spans[0].start_s == 0
    assert spans[-1].end_s == 10
    assert all(one.end_s == following.start_s for one, following in itertools.pairwise(spans))
    with av.open("speech.mp4") as film:
        streams = {stream.type: float(stream.duration * stream.time_base) for stream in film.streams}
        assert film.streams.video[0].frames == 250
    assert streams == {"video": pytest.approx(10), "audio": pytest.approx(10, abs=0.1)}


def test_the_same_file_gives_the_same_bytes_and_another_seed_others(call):
    for number, options in enumerate([[], [], ["--seed", "2012"], ["--seed", "1"]]):
        assert call("speech.wav", "--out", number, *options).status == 0
    for end in (".bvh", ".motion.parquet", ".mp4", ".TextGrid"):
        first, again, own_seed, other = (Path(str(number), f"speech{end}").read_bytes() for number in range(4))
        assert first == again == own_seed
        assert first != other


def test_formats_are_chosen_and_several_files_written_to_a_new_folder(call):
    shutil.copy("speech.wav", "talk.final.wav")
    ended = call("speech.wav", "talk.final.wav", "--out", "a/b", "--format", "bvh,textgrid", "--format", "bvh")
    written = [f"a/b/{name}{end}" for name in ("speech", "talk.final") for end in (".bvh", ".TextGrid")]
    assert (ended.status, ended.out) == (0, written)
    assert files() == {"talk.final.wav", "a", "a/b", *written}


def test_stereo_and_8_khz_are_read_and_noted(call):
    samples = soundfile.read("speech.wav")[0][::2]
    soundfile.write("two.wav", np.column_stack([samples, np.zeros_like(samples)]), 8000)
    notes = [
        "cospeech: two.wav: 2 channels mixed down to one",
        "cospeech: two.wav: resampled from 8000 Hz to 16000 Hz (nothing above 4000 Hz)",
    ]
    ended = call("two.wav", "--format", "bvh")
    assert (ended.status, ended.err) == (0, [BUNDLED, *notes])
    assert call("two.wav", "--format", "bvh", "--out", "one", "--channel", 1).status == 0
    ended = call("two.wav", "speech.wav", "--format", "bvh", "--out", "three", "--channel", 3)
    assert (ended.status, ended.out) == (1, [])
    assert "two.wav: has 2 channel(s), so there is no channel 3" in ended.err[1]


def silent_film(path):
    with av.open(path, "w") as container:
        film = container.add_stream("libx264", rate=10)
        film.width, film.height, film.pix_fmt = 64, 64, "yuv420p"
        container.mux(film.encode(av.VideoFrame.from_ndarray(np.zeros((64, 64, 3), np.uint8))))
        container.mux(film.encode(None))


def test_files_that_are_wrong_take_one_line_each_and_the_others_are_processed(call):
    speech = soundfile.read("speech.wav")[0]
    Path("folder.wav").mkdir()
    Path("empty.wav").touch()
    Path("text.wav").write_text("no sound at all\n" * 100)
    Path("cut.mp3").write_bytes(b"ID3\x04")
    silent_film("film.mp4")
    soundfile.write("silent.wav", np.zeros(16000), 16000)
    soundfile.write("short.wav", speech[:200], 16000)
    soundfile.write("noise.wav", np.random.default_rng(1).normal(0, 0.1, 16000), 16000)
    soundfile.write("nan.wav", np.append(speech, np.nan), 16000, subtype="FLOAT")
    wrong = {
        "missing.wav": "no such file; correct the path",
        "folder.wav": "is a folder; name a sound file",
        "empty.wav": "is empty; copy it again",
        "text.wav": "cannot be decoded as sound .*; convert it to wav",
        "cut.mp3": "cannot be decoded as sound .*; convert it to wav",
        "film.mp4": "contains no sound; name a file with speech",
        "silent.wav": "is silent; check the recording",
        "short.wav": "the sound lasts 0.013 s, less than one frame of 0.025 s",
        "noise.wav": "record 'noise': no frame is voiced .*",
        "nan.wav": r"contains NaN or infinity at 10\.000 s; export it again",
    }
    before = files()
    ended = call(*wrong, "speech.wav", "--format", QUICK)
    assert ended.status == 1
    assert len(ended.err) == len(wrong) + 1
    for line, (name, reason) in zip(ended.err[1:], wrong.items(), strict=True):
        assert re.fullmatch(rf"cospeech: {name}: {reason}", line), line
    assert ended.out == ["speech.bvh", "speech.motion.parquet", "speech.TextGrid"]
    assert files() - before == set(ended.out)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ((), "the following arguments are required: FILE"),
        (("speech.wav", "--format", "bvh,fbx"), "unknown format 'fbx'; known are bvh, table, mp4, textgrid"),
        (("speech.wav", "--seed", "-1"), "'-1' is not a whole number, 0 or greater"),
        (("speech.wav", "--seed", "1.5"), "'1.5' is not a whole number, 0 or greater"),
        (("speech.wav", "--channel", "0"), "'0' is not a whole number, 1 or greater"),
        (("speech.wav", "--quiet"), "unrecognized arguments: --quiet"),
        (("a/speech.wav", "b/speech.mp3"), "two files are called 'speech', and so would their results"),
    ],
)
def test_a_wrong_call_ends_with_status_2(call, arguments, complaint):
    ended = call(*arguments)
    assert ended.status == 2
    assert complaint in ended.err[-1]
    assert files() == set()


@pytest.fixture
def model(tmp_path_factory):
    """A copy of the bundled model, to be damaged."""
    folder = tmp_path_factory.mktemp("models") / "ada"
    shutil.copytree(api.BUNDLED, folder)
    return folder


def refused(call, model):
    """Return the one line about a model, after which nothing was written."""
    ended = call("speech.wav", "--model", model, "--out", "out")
    assert (ended.status, ended.out, files()) == (1, [], set())
    (line,) = ended.err
    return line


@pytest.mark.parametrize("name", sorted(path.name for path in api.BUNDLED.iterdir()))
def test_a_model_with_a_missing_or_damaged_file_is_refused(call, model, name):
    path = model / name
    changed = bytearray(path.read_bytes())
    changed[len(changed) // 3] ^= 1
    path.write_bytes(changed)
    assert refused(call, model).startswith(f"cospeech: {path}: damaged")
    path.unlink()
    assert refused(call, model).startswith(f"cospeech: {model}: ")
    assert f"{name}" in refused(call, model)


def rewrite(model, **entries):
    """Change entries of a card as another cospeech would have written them."""
    card = json.loads((model / "model.json").read_text()) | entries
    (model / "model.json").write_text(json.dumps(card | {"sha256": model_folder.checksum(card)}))


def test_a_model_that_does_not_fit_is_refused(call, model):
    assert "no such model folder; correct the path" in refused(call, model / "none")
    assert "no such model folder" in refused(call, "speech.wav")
    rewrite(model, system="gestures_of_tomorrow")
    assert f"{model}: no installed package has a system 'gestures_of_tomorrow'" in refused(call, model)
    rewrite(model, system="majority")
    assert f"{model}: not a model of 'majority' as installed, which has a table 'pool'" in refused(call, model)
    rewrite(model, format=0)
    assert "has format 0, but this version of cospeech reads format 1" in refused(call, model)


def test_the_body_must_be_a_motion_table_as_long_as_the_sound(call):
    def complaint(body):
        ended = call("speech.wav", "--body", body, "--format", "bvh")
        assert (ended.status, ended.out) == (1, [])
        return ended.err[-1]

    motion = next(iter(api.load_model().motions.values()))
    tables.write(motion, "long.parquet", "motion", corpus="virtual", config_hash="0")
    assert (
        "speech.wav: the motion of the body has 1125 frames at 25 fps; the sound of 10.000 s needs 250"
        in complaint("long.parquet")
    )
    assert "none.parquet: no such file" in complaint("none.parquet")
    assert "speech.wav: damaged or not a Parquet file" in complaint("speech.wav")
    assert files() == {"long.parquet"}
    tables.write(motion[:250], "body.parquet", "motion", corpus="virtual", config_hash="0")
    assert call("speech.wav", "--body", "body.parquet", "--format", "table").status == 0
    made = tables.read("speech.motion.parquet", "motion")
    assert made["head_x_deg"].equals(motion["head_x_deg"][:250])


@pytest.mark.parametrize("out", ["file", "file/below", "/proc/nothing"])
def test_an_output_folder_that_cannot_be_written_to_is_refused(call, out):
    Path("file").touch()
    ended = call("speech.wav", "--out", out)
    assert (ended.status, ended.out, files()) == (1, [], {"file"})
    (line,) = ended.err
    assert re.fullmatch(rf"cospeech: {out}: not a writable folder \(.+\); name another with --out", line)


def test_no_empty_folder_is_left_where_all_files_are_wrong(call):
    Path("kept").mkdir()
    for out in ("kept", "kept/new/deep"):
        assert call("nowhere.wav", "--out", out).status == 1
        assert files() == {"kept"}


def test_a_file_in_the_way_is_kept_unless_it_may_be_replaced(call):
    Path("speech.TextGrid").write_text("corrected by hand")
    shutil.copy("speech.wav", "talk.wav")
    ended = call("speech.wav", "talk.wav", "--format", QUICK)
    assert (ended.status, len(ended.out)) == (1, 3)
    assert ended.err[1:] == [
        "cospeech: speech.TextGrid: already exists; replace it with --overwrite, or name another folder with --out"
    ]
    assert Path("speech.TextGrid").read_text() == "corrected by hand"
    assert not Path("speech.bvh").exists()
    assert call("speech.wav", "--format", QUICK, "--overwrite").status == 0
    assert "IntervalTier" in Path("speech.TextGrid").read_text()


def test_a_folder_in_the_way_is_not_replaced(call):
    Path("speech.bvh").mkdir()
    ended = call("speech.wav", "--format", QUICK, "--overwrite")
    assert ended.status == 1
    assert "speech.bvh: is a folder; move it away" in ended.err[-1]
    assert files() == {"speech.bvh"}


@pytest.fixture
def interrupted(monkeypatch):
    """Let the writing of the second format do something else first."""

    def by(action):
        write = synthesize.write

        def written(name, *others):
            if name == "table":
                action()
            write(name, *others)

        monkeypatch.setattr(synthesize, "write", written)

    return by


def test_a_full_disk_leaves_nothing(call, interrupted):
    def fail():
        raise OSError(28, "No space left on device")

    interrupted(fail)
    ended = call("speech.wav", "--format", QUICK)
    assert ended.status == 1
    assert ended.err[1:] == ["cospeech: speech.wav: its results cannot be written to . (No space left on device)"]
    assert files() == set()


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interruption_leaves_nothing(call, interrupted, number, status):
    before = signal.getsignal(signal.SIGTERM)
    interrupted(lambda: os.kill(os.getpid(), number))
    ended = call("speech.wav", "--format", QUICK)
    assert (ended.status, ended.out, files()) == (status, [], set())
    assert signal.getsignal(signal.SIGTERM) == before


def test_the_first_compilation_is_announced(call, tmp_path):
    program = "import sys; from cospeech import cli; sys.exit(cli.main())"
    said = [
        subprocess.run(
            [sys.executable, "-c", program, "synthesize", "none.wav"],
            env=os.environ | {"NUMBA_CACHE_DIR": str(folder)}, capture_output=True, text=True,
        ).stderr.splitlines()
        for folder in (tmp_path / "none", tmp_path)
    ]  # fmt: skip
    assert "cospeech: compiling the inner loops, which takes about 10 s, only this time" in said[0]
    assert said[1] == said[0][1:]


def test_the_bundled_model_is_small_and_of_the_current_format():
    """``make bundled-model`` trains it again."""
    assert sum(path.stat().st_size for path in api.BUNDLED.iterdir()) < 2_000_000
    model = api.load_model()
    card = model.card
    assert (card["format"], card["corpus"], card["system"]) == (model_folder.FORMAT, "virtual", "hsmm_sampled")
    assert {path.name for path in api.BUNDLED.iterdir()} == {
        "model.json",
        *(f"{name}.parquet" for name in card["tables"]),
    }
    for name in card["tables"]:
        assert tables.read_metadata(api.BUNDLED / f"{name}.parquet")["corpus"] == "virtual"
    settings = api.default_settings()
    assert card["speech"] == settings["speech"]
    assert card["smoothing"] == settings["animation"]["smoothing"]
    assert set(model.gestures["label"]) == set(settings["phrases"]["gesture"]["labels"])


def test_the_sound_of_the_video_is_the_speech(call):
    call("speech.wav", "--format", "mp4")
    with av.open("speech.mp4") as film:
        heard = np.concatenate([frame.to_ndarray()[0] for frame in film.decode(audio=0)])
    spoken = sound.read("speech.wav").samples
    lag = np.argmax(np.correlate(heard[32000:66048], spoken[32000:64000], "valid"))
    assert np.corrcoef(heard[32000 + lag : 64000 + lag], spoken[32000:64000])[0, 1] > 0.9

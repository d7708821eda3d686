"""People's own films and marker files become joint angles; what is wrong with one is said, and no other harmed.

What another laboratory would bring is made of the studio's: films with sound of views that do not begin together, in
ordinary H.264, with a calibration in TOML; and marker files under other names, with other axes.
"""

import shutil
from fractions import Fraction

import av
import ezc3d
import numpy as np
import pytest
import soundfile
import yaml
from pictures import ordinary
from project import Project
from scipy.spatial.transform import Rotation
from test_bad_input import messages

from cospeech.data import tables, trajectories
from cospeech.data.trajectories import Trajectories
from cospeech.formats import c3d, camera_toml
from cospeech.motion import markers, skeleton
from cospeech.studio import cast, dress, film, motion, range_of_motion, rig, script, stage

pytestmark = [pytest.mark.workflow, pytest.mark.slow, pytest.mark.xdist_group("own_capture")]

FPS, SECONDS = 50.0, 6.0
THEIRS = {name: name.upper() for name in markers.NAMES if not name.endswith(("leg", "foot"))}

FILM_FPS, N_FRAMES, RATE_HZ = 20, 50, 16000
LATE_FRAMES = {"c1": 1, "c2": 0, "c3": 4, "c4": 0, "c5": 2}
"""How many frames after the scene each camera was started; the sound's recorder was started with the scene."""

GOOD = ("c3d_gaps", "films_good")
BAD = {
    "c3d_unitless": "does not say its unit",
    "films_truncated": "c2.mkv: truncated",
}
"""Every bad record, named by what is wrong with it, and words that its message must hold."""


def performance(actor):
    """What the actor does in a record: a motion table at ``FPS``."""
    gestures, prosody = script.write(cast.member(actor, 1, 0.025, 10.0), "x", SECONDS, 0.8, 0.025, 1)
    return motion.perform(actor, "x", gestures, prosody, FPS, 1)


def swing():
    """What the actor does before the cameras: both arms up and back."""
    time_s = np.arange(N_FRAMES) / FILM_FPS
    high = np.sin(np.pi * time_s / 2.5) ** 2
    angles = np.zeros((N_FRAMES, len(skeleton.JOINTS), 3))
    for side, sign in (("left", 1), ("right", -1)):
        angles[:, skeleton.JOINTS.index(f"{side}_arm"), 0] = -50 * high
        angles[:, skeleton.JOINTS.index(f"{side}_arm"), 2] = sign * (4 + 15 * high)
        angles[:, skeleton.JOINTS.index(f"{side}_forearm"), 0] = -5 - 80 * high
    return skeleton.motion_table(np.zeros((N_FRAMES, 3)), angles, FILM_FPS)


def recording(moved):
    """The markers of a motion as another laboratory has them: under its names, z up, facing -y."""
    places = dress.wear(moved, dress.places("ada", 1))[:, [markers.NAMES.index(name) for name in THEIRS]]
    z_up = np.stack([places[..., 0], -places[..., 2], places[..., 1]], axis=-1)
    return Trajectories(tuple(THEIRS.values()), z_up, FPS)


def write_markers(path, held):
    """Write a recording with what the name of its file says is wrong with it."""
    how = path.stem.partition("_")[2]
    names, places, fps, _ = held
    if how == "gaps":
        places = places.copy()
        places[50:60, names.index("LEFT_HAND")] = np.nan
    c3d.write(Trajectories(names, places, fps), path)
    if how == "unitless":
        file = ezc3d.c3d(str(path))
        file["parameters"]["POINT"]["UNITS"]["value"] = [""]
        file.write(str(path))


def write_film(path, pictures, samples):
    """An H.264 film in 4:2:0 with sound."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=FILM_FPS, options={"crf": "8", "preset": "ultrafast"})
        voice = container.add_stream("flac", rate=RATE_HZ, layout="mono")
        stream.height, stream.width = pictures[0].shape[1:]
        stream.pix_fmt = "yuv420p"
        for picture in pictures:
            container.mux(stream.encode(ordinary(picture)))
        container.mux(stream.encode())
        sound = av.AudioFrame.from_ndarray((32767 * samples).astype(np.int16)[None], format="s16", layout="mono")
        sound.sample_rate, sound.pts, sound.time_base = RATE_HZ, 0, Fraction(1, RATE_HZ)
        container.mux(voice.encode(sound))
        container.mux(voice.encode())


def film_scene(top):
    """Film the swing into the folders of the two filmed records, and write the rig and the records' sound."""
    (top / "films_good").mkdir()
    draw = np.random.default_rng(3)
    sound = np.zeros(round(N_FRAMES / FILM_FPS * RATE_HZ))
    for start in (np.cumsum(draw.uniform(0.05, 0.35, 10)) * RATE_HZ).astype(int):
        sound[start : start + 2000] += (draw.normal(0, 0.1, 2000) * np.exp(-np.arange(2000) / 600))[
            : len(sound) - start
        ]
    cameras, moved = rig.cameras(696, 1), swing()
    limbs, worn = stage.limbs(moved), dress.wear(moved, dress.places("ada", 1))
    for camera in cameras:
        late = LATE_FRAMES[camera.name]
        pictures = [picture.copy() for picture, _ in film.frames(camera, limbs[late:], worn[late:], 1)]
        heard = 0.5 * sound[round(late / FILM_FPS * RATE_HZ) :]
        write_film(top / "films_good" / f"{camera.name}.mkv", pictures, heard + draw.normal(0, 0.001, len(heard)))
    shutil.copytree(top / "films_good", top / "films_truncated")
    cut = top / "films_truncated" / "c2.mkv"
    cut.write_bytes(cut.read_bytes()[: cut.stat().st_size // 2])
    soundfile.write(top / "scene.wav", sound, RATE_HZ)
    (top / "rig.toml").write_text(camera_toml.toml(cameras))
    return moved, worn


@pytest.fixture(scope="module")
def tried(tmp_path_factory):
    """A run on films and marker files of one actor: the results, what was said, and what was planted."""
    top = tmp_path_factory.mktemp("own_capture")
    moved = performance("ada")
    swung, worn = film_scene(top)
    soundfile.write(top / "voice.wav", 0.3 * np.sin(np.arange(int(SECONDS * 16000)) / 20), 16000)
    records = []
    for name in (*GOOD, *BAD):
        record = {"record": name, "actor": "ada"}
        if name.startswith("films"):
            record |= {"views": str(top / name), "audio": str(top / "scene.wav")}
        else:
            write_markers(top / f"{name}.c3d", recording(moved))
            record |= {"motion": str(top / f"{name}.c3d"), "audio": str(top / "voice.wav")}
        records.append(record)
    c3d.write(recording(range_of_motion.perform(FPS)), top / "range.c3d")
    config = {
        "run": "own",
        "corpus": {"source": "recorded", "name": "own", "records": records,
                   "markers": {"up": "z", "facing": "-y", "names": THEIRS}},
        "capture": {"calibration": {"method": "given", "file": str(top / "rig.toml")},
                    "ranges": {"ada": str(top / "range.c3d")}},
        "phrases": {"gesture": {"first_examples": "rules"}},
    }  # fmt: skip
    (top / "config.yaml").write_text(yaml.safe_dump(config))
    project = Project(top / "project")
    project.folder.mkdir()
    targets = [f"results/own/corpus/records/{name}.parquet" for name in (*GOOD, *BAD)]
    ended = project.run(*targets, config=top / "config.yaml")
    return project.folder / "results" / "own", ended, {"c3d_gaps": moved, "films_good": swung, "worn": worn}


def row_of(results, record):
    return tables.read(results / "corpus" / "records" / f"{record}.parquet", "records").iloc[0]


def degrees_apart(found, true):
    """Degrees (T, J) between the orientations of all joints in two motion tables."""
    turns = [
        skeleton.chain(moved[list(skeleton.ROOT_COLUMNS)].to_numpy(), skeleton.angles(moved))[0]
        for moved in (found, true)
    ]
    between = Rotation.from_matrix((np.swapaxes(turns[0], 2, 3) @ turns[1]).reshape(-1, 3, 3))
    return np.degrees(between.magnitude()).reshape(len(found), -1)


def test_each_bad_record_has_one_message_that_names_it(tried):
    _, ended, _ = tried
    assert ended.returncode != 0
    assert "Traceback" not in ended.stdout
    assert len(messages(ended.stdout)) == len(BAD), ended.stdout[-3000:]
    for name, words in BAD.items():
        assert words in messages(ended.stdout, name).pop()


def test_marker_files_become_the_joint_angles_that_were_planted(tried):
    results, _, truth = tried
    row = row_of(results, "c3d_gaps")
    assert (row["motion_source"], row["motion_fps"], row["duration_s"]) == ("markers", FPS, SECONDS)
    assert row["motion_path"].endswith("c3d_gaps.c3d")
    world = tables.read(results / "capture" / "c3d_gaps" / "markers_3d.parquet", "markers_3d")
    hand = world[world["marker"] == "left_hand"]["status"].to_numpy()
    assert np.flatnonzero(hand == "predicted").tolist() == list(range(50, 60))
    found = tables.read(results / "motion" / "c3d_gaps.parquet", "motion")
    apart = degrees_apart(found, truth["c3d_gaps"])
    assert apart[:, [skeleton.JOINTS.index(joint) for joint in ("chest", "head")]].max() < 0.5


def test_films_that_did_not_begin_together_become_the_markers_and_angles_that_were_planted(tried):
    results, _, truth = tried
    row = row_of(results, "films_good")
    assert (row["motion_source"], row["motion_fps"]) == ("video", FILM_FPS)
    assert row["motion_path"].endswith("films_good")
    began = tables.read(results / "capture" / "films_good" / "offsets.parquet", "offsets").set_index("stream")
    for view, late in LATE_FRAMES.items():
        assert began.loc[view, "offset_s"] == pytest.approx(late / FILM_FPS, abs=0.01)
    first = max(LATE_FRAMES.values())
    assert row["note"].startswith(f"sound taken from {began.loc['sound', 'skipped_s']:.3f} s on")
    world = tables.read(results / "capture" / "films_good" / "markers_3d.parquet", "markers_3d")
    places = trajectories.to_array(world, markers.NAMES)
    away = np.linalg.norm(places - truth["worn"][first:], axis=2)
    seen = (world["status"] == "seen").to_numpy().reshape(away.shape)
    assert seen.mean() > 0.95
    assert np.sqrt(np.mean(away[seen] ** 2)) < 0.001
    found = tables.read(results / "motion" / "films_good.parquet", "motion")
    apart = degrees_apart(found, truth["films_good"].iloc[first : first + len(found)])
    for joint in ("chest", "head"):
        assert np.sqrt(np.mean(apart[:, skeleton.JOINTS.index(joint)] ** 2)) < 0.5, joint


def test_bad_records_leave_nothing_half_written(tried):
    results, _, _ = tried
    assert Project(results.parents[1]).problems("own") == []
    assert {path.stem for path in (results / "corpus" / "records").glob("*.parquet")} == set(GOOD)

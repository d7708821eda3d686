"""TRC files are read again as written, with their gaps; incomplete files are rejected in one line."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.data.trajectories import Trajectories
from cospeech.errors import UserError
from cospeech.formats import trc

DATA = Path(__file__).parents[3] / "shared" / "data"
BALANCING = DATA / "pose2sim_balancing" / "points_3d" / "S00_P00_T01_BalancingTrial_0-100.trc"
ARM = DATA / "pyomeca_arm" / "markers.trc"

SMALL = """PathFileType\t4\t(X/Y/Z)\tsmall.trc
DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames
50\t50\t3\t2\tmm\t50\t1\t3
Frame#\tTime\tchest\t\t\thead top\t\t\t
\t\tX1\tY1\tZ1\tX2\tY2\tZ2

1\t0.00\t1000\t2000\t3000\t10\t20\t30
2\t0.02\t\t\t\t11\t21\t31
3\t0.04\t0\t0\t0\tnan\t1\t2
"""


def saved(tmp_path, text):
    path = tmp_path / "a.trc"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("mark", ["\t", ",", ";"])
def test_unit_rate_names_and_gaps_are_read(tmp_path, mark):
    names, places, fps, _ = trc.read(saved(tmp_path, SMALL.replace("\t", mark)))
    assert (names, fps) == (("chest", "head top"), 50.0)
    lost = [np.nan] * 3
    expected = [[[1, 2, 3], [0.01, 0.02, 0.03]], [lost, [0.011, 0.021, 0.031]], [lost, lost]]
    np.testing.assert_allclose(places, expected)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\tmm\t", "\tMillimeters\t"),
        lambda text: text.replace(".", ","),
        lambda text: text.replace(".", ",").replace("\t", ";"),
        lambda text: "# exported\n" + text.replace("\n3\t", "\n// cut here\n3\t"),
        lambda text: text.replace("\n", "\n\n"),
        lambda text: text.replace("PathFileType", "pathfiletype").replace("NumFrames", "numframes"),
        lambda text: text.replace("\t3\t2\tmm", "\t3.0\t2\tmm"),
    ],
)
def test_what_spreadsheets_and_people_change_does_not_matter(tmp_path, change):
    expected, found = trc.read(saved(tmp_path, SMALL)), trc.read(saved(tmp_path, change(SMALL)))
    assert (found.names, found.fps, found.notes) == (expected.names, expected.fps, ())
    np.testing.assert_array_equal(found.places_m, expected.places_m)


coordinate = st.floats(-50, 50).map(lambda x: round(x, 6) + 0.0) | st.just(np.nan)
name = st.text("abcXYZ_ 19:é", min_size=1, max_size=8).map(lambda s: " ".join(s.split())).filter(bool)


@st.composite
def recordings(draw):
    names = draw(st.lists(name, min_size=1, max_size=4, unique=True))
    n_frames = draw(st.integers(1, 6))
    values = draw(st.lists(coordinate, min_size=3 * n_frames * len(names), max_size=3 * n_frames * len(names)))
    places = np.array(values).reshape(n_frames, len(names), 3)
    places[np.isnan(places).any(axis=2) | (places == 0).all(axis=2)] = np.nan
    return Trajectories(tuple(names), places, draw(st.sampled_from([20.0, 29.97, 60.0, 100.0, 240.0])))


@settings(max_examples=100, deadline=None)
@given(recordings())
def test_what_is_written_is_read_again(tmp_path_factory, recording):
    path = tmp_path_factory.mktemp("trc") / "a.trc"
    trc.write(recording, path)
    names, places, fps, _ = trc.read(path)
    assert (names, fps) == (recording.names, recording.fps)
    np.testing.assert_allclose(places, recording.places_m, atol=1e-9)


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_a_damaged_file_is_read_completely_or_rejected(tmp_path_factory, data):
    text = list(SMALL)
    for _ in range(data.draw(st.integers(1, 6))):
        place = data.draw(st.integers(0, len(text) - 1))
        text[place : place + data.draw(st.integers(0, 8))] = data.draw(
            st.text("\t\n,.0123456789-e#XnaFm", max_size=4)
        )
    try:
        names, places, fps, _ = trc.read(saved(tmp_path_factory.mktemp("trc"), "".join(text)))
    except UserError:
        return
    assert places.shape[1:] == (len(names), 3)
    assert all(names)
    assert fps >= 1
    assert not np.isinf(places).any()
    lost = np.isnan(places)
    assert (lost.any(axis=2) == lost.all(axis=2)).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("PathFileType", "Path"), "is not a TRC file"),
        (("\tmm\t", "\t\t"), "does not state its unit"),
        (("\tmm\t", "\tfeet\t"), "unknown unit 'feet'"),
        (("50\t50\t3", "50\t50\t4"), "announces 4 frames and holds 3"),
        (("50\t50\t3\t2", "x\t50\t3\t2"), "do not say DataRate"),
        (("50\t50\t3", "25\t50\t3"), r"time of frame 1 .* contradicts 25 Hz; .* the times, which run at 50 Hz"),
        (("50\t50\t3", "10001\t50\t3"), "3 frames of 2 markers at 10001 Hz; export it again"),
        (("50\t50\t3", "50\t50\t1"), "announces 1 frames and holds more, 3; correct NumFrames in line 3"),
        (("3\t0.04", "3\t1e-320"), r"time of frame 2 .* contradicts 50 Hz; correct DataRate or the times"),
        (("2\t0.02", "2\t"), "frame 1 .* has no time"),
        (("2\t0.02\t\t\t\t11\t21\t31", "2 0.02 11 21 31"), "line 8: has 5 of 8 values, separated by spaces"),
        (("head top", ""), "does not name 2 markers"),
        (("2\t0.02", "4\t0.02"), "frame 1 .* is not numbered one more"),
        (("2000", "2O00"), "line 7: .* not a number .*2O00"),
        (("2000", "inf"), "line 7: holds an infinite number"),
        (("10\t20\t30", "10\t20\t30\t40"), "line 7: has more than 8 values"),
    ],
)
def test_errors_are_reported_with_their_place(tmp_path, change, message):
    with pytest.raises(UserError, match=message) as caught:
        trc.read(saved(tmp_path, SMALL.replace(*change, 1)))
    assert len(str(caught.value).splitlines()) == 1


def test_missing_and_truncated_files_are_rejected(tmp_path):
    with pytest.raises(UserError, match="cannot be read"):
        trc.read(tmp_path / "none.trc")
    with pytest.raises(UserError, match="truncated in its header"):
        trc.read(saved(tmp_path, "\n".join(SMALL.splitlines()[:4])))
    with pytest.raises(UserError, match="a TRC file cannot hold the marker name"):
        trc.write(Trajectories(("a\tb",), np.zeros((1, 1, 3)), 20.0), tmp_path / "a.trc")


def test_written_times_begin_at_zero(tmp_path):
    trc.write(Trajectories(("a",), np.ones((3, 1, 3)), 50.0), tmp_path / "a.trc")
    rows = [line.split("\t") for line in (tmp_path / "a.trc").read_text().splitlines()[5:]]
    assert [(row[0], float(row[1])) for row in rows] == [("1", 0.0), ("2", 0.02), ("3", 0.04)]


@pytest.mark.parametrize(
    ("first", "change"),
    [(0, lambda line: line.replace("\t", " ")), (4, lambda line: line), (5, lambda line: line)],
)
def test_spaces_instead_of_tabs_are_read(tmp_path, first, change):
    """In all lines, or only in the header."""
    expected = trc.read(saved(tmp_path, SMALL))
    lines = SMALL.replace("head top", "head").splitlines()
    changed = [change(line) for line in lines[first:]]
    header = [line.replace("\t", " ") if number != 3 else line for number, line in enumerate(lines[:first])]
    found = trc.read(saved(tmp_path, "\n".join([*header, *changed])))
    assert (found.names, found.fps) == (("chest", "head"), 50.0)
    np.testing.assert_array_equal(found.places_m, expected.places_m)


def timed(tmp_path, stated, times, n_announced=None):
    """A file of one marker with the given DataRate and times, as text."""
    head = SMALL.splitlines()[:5]
    head[2] = f"{stated}\t{stated}\t{n_announced or len(times)}\t1\tm\t{stated}\t1\t{len(times)}"
    head[3:] = ["Frame#\tTime\tchest", "\t\tX1\tY1\tZ1"]
    rows = [f"{frame}\t{time}\t1\t2\t3" for frame, time in enumerate(times, start=1)]
    return trc.read(saved(tmp_path, "\n".join([*head, *rows])))


def test_one_frame_more_than_announced_is_read_and_noted(tmp_path):
    found = timed(tmp_path, "50", [f"{frame / 50:.6f}" for frame in range(20)], n_announced=19)
    assert len(found.places_m) == 20
    assert found.notes == ("the file holds one frame more than the 19 that it announces; all were read",)


@pytest.mark.parametrize("fps", [30.0, 60.0, 100.0, 120.0, 240.0])
@pytest.mark.parametrize("decimals", [2, 3])
def test_times_of_few_decimals_are_read(tmp_path, fps, decimals):
    rounded = [f"{frame / fps:.{decimals}f}" for frame in range(300)]
    truncated = [f"{int(frame / fps * 10**decimals + 1e-9) / 10**decimals:.{decimals}f}" for frame in range(300)]
    for times in (rounded, truncated):
        found = timed(tmp_path, f"{fps:g}", times)
        assert (found.fps, found.notes) == (fps, ())


def test_times_tell_a_rate_of_television_from_its_whole_number(tmp_path):
    for whole, rate in (("30", 29.97), ("60", 59.94)):
        found = timed(tmp_path, whole, [f"{frame / rate:.6f}" for frame in range(300)])
        assert found.fps == rate
        assert found.notes == (f"frame rate {whole} in the file taken as {rate}, at which its times run",)
    found = timed(tmp_path, "59.94", [f"{frame / 60:.6f}" for frame in range(300)])
    assert (found.fps, found.notes) == (59.94, ())
    found = timed(tmp_path, "30", [f"{frame / 29.97:.2f}" for frame in range(200)])
    assert found.fps == 30  # two decimals over seven seconds cannot tell


def test_times_that_drift_by_half_a_percent_contradict_the_rate(tmp_path):
    with pytest.raises(UserError, match=r"contradicts 50 Hz; correct DataRate or the times, which run at 50.25 Hz"):
        timed(tmp_path, "50", [f"{frame / 50.25:.6f}" for frame in range(60)])
    with pytest.raises(UserError, match=r"contradicts 30 Hz"):
        timed(tmp_path, "30", [f"{frame / 29:.2f}" for frame in range(60)])


def test_markers_may_share_a_name(tmp_path):
    assert trc.read(saved(tmp_path, SMALL.replace("head top", "chest"))).names == ("chest", "chest")


def test_a_declared_unit_replaces_that_of_the_file(tmp_path):
    found = trc.read(saved(tmp_path, SMALL.replace("mm", "feet")), unit=0.3048)
    np.testing.assert_allclose(found.places_m[0, 0], np.array([1000, 2000, 3000]) * 0.3048)
    assert found.notes == ("unit 'feet' of the file replaced by the declared 0.3048 m",)
    inches = trc.read(saved(tmp_path, SMALL.replace("mm", "in")))
    np.testing.assert_allclose(inches.places_m[0, 0], np.array([1000, 2000, 3000]) * 0.0254)


def test_names_in_another_encoding_are_named(tmp_path):
    (tmp_path / "a.trc").write_bytes(SMALL.replace("head top", "左腕").encode("euc_jp"))
    with pytest.raises(UserError, match=r"line 4 is not in UTF-8 .*'左腕' in EUC-JP"):
        trc.read(tmp_path / "a.trc")


@pytest.mark.recorded
@pytest.mark.skipif(not BALANCING.is_file(), reason="needs the real recordings in ../shared/data/pose2sim_balancing")
def test_a_real_file_of_pose2sim_stands_upright_in_metres():
    names, places, fps, _ = trc.read(BALANCING)
    assert (len(names), places.shape, fps) == (21, (100, 21, 3), 60.0)
    assert names[:3] == ("RHip", "RKnee", "RAnkle")
    height = places[:, names.index("Nose"), 1] - places[:, names.index("RHeel"), 1]
    assert 1.2 < np.nanmedian(height) < 1.9
    shin = np.linalg.norm(places[:, names.index("RKnee")] - places[:, names.index("RAnkle")], axis=1)
    assert 0.35 < np.nanmedian(shin) < 0.5


@pytest.mark.recorded
@pytest.mark.skipif(not ARM.is_file(), reason="needs the real recordings in ../shared/data/pyomeca_arm")
def test_a_real_file_that_holds_fewer_frames_than_it_announces_is_rejected():
    with pytest.raises(UserError, match="announces 652 frames and holds"):
        trc.read(ARM)

"""C3D files are read again by us and by ezc3d alone; files without a unit are rejected."""

from pathlib import Path

import ezc3d
import numpy as np
import pytest

from cospeech.data.trajectories import Trajectories
from cospeech.errors import UserError
from cospeech.formats import c3d

DATA = Path(__file__).parents[3] / "shared" / "data" / "pyomeca_arm"
ARM = DATA / "markers_analogs.c3d"


def recording(n_frames=70, seed=0):
    draw = np.random.default_rng(seed)
    places = draw.normal(0, 1, (n_frames, 3, 3))
    places[10:20, 1] = np.nan
    places[0, 0] = np.nan
    return Trajectories(("left_hand", "chest", "a name as long as it may ever be"), places, 20.0)


def test_what_is_written_is_read_again_to_the_formats_single_precision(tmp_path):
    given = recording()
    c3d.write(given, tmp_path / "a.c3d")
    names, places, fps = c3d.read(tmp_path / "a.c3d")
    assert (names, fps) == (given.names, given.fps)
    np.testing.assert_allclose(places, given.places_m, atol=1e-6)
    c3d.write(given, tmp_path / "b.c3d")
    assert (tmp_path / "a.c3d").read_bytes() == (tmp_path / "b.c3d").read_bytes()


def test_ezc3d_alone_reads_millimetres_rate_names_and_gaps(tmp_path):
    given = recording()
    c3d.write(given, tmp_path / "a.c3d")
    other = ezc3d.c3d(str(tmp_path / "a.c3d"))
    point = other["parameters"]["POINT"]
    assert point["UNITS"]["value"] == ["mm"]
    assert (point["RATE"]["value"][0], point["FRAMES"]["value"][0], point["USED"]["value"][0]) == (20.0, 70, 3)
    assert tuple(point["LABELS"]["value"]) == given.names
    points = other["data"]["points"][:3].transpose(2, 1, 0)
    np.testing.assert_allclose(points, given.places_m * 1000, atol=1e-3)
    np.testing.assert_array_equal(other["data"]["meta_points"]["residuals"][0].T < 0, np.isnan(points[:, :, 0]))


def rewritten(tmp_path, **parameters):
    """A file of ours with changed POINT parameters."""
    c3d.write(recording(), tmp_path / "a.c3d")
    file = ezc3d.c3d(str(tmp_path / "a.c3d"))
    for name, value in parameters.items():
        file["parameters"]["POINT"][name]["value"] = value
    file.write(str(tmp_path / "b.c3d"))
    return tmp_path / "b.c3d"


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"UNITS": [""]}, "does not say its unit"),
        ({"UNITS": ["furlong"]}, "unknown unit 'furlong'"),
        ({"LABELS": ["a", "b", "a"]}, "two markers are called 'a'"),
    ],
)
def test_a_file_without_unit_names_or_rate_is_rejected(tmp_path, parameters, message):
    with pytest.raises(UserError, match=message):
        c3d.read(rewritten(tmp_path, **parameters))


def test_units_become_metres(tmp_path):
    given = recording()
    _, places, _ = c3d.read(rewritten(tmp_path, UNITS=["cm"]))
    np.testing.assert_allclose(places, 10 * given.places_m, atol=1e-5)


def test_missing_foreign_and_truncated_files_are_rejected(tmp_path):
    with pytest.raises(UserError, match="cannot be read"):
        c3d.read(tmp_path / "none.c3d")
    (tmp_path / "a.c3d").write_bytes(b"RIFF" * 400)
    with pytest.raises(UserError, match="is not a C3D file"):
        c3d.read(tmp_path / "a.c3d")
    c3d.write(recording(700), tmp_path / "b.c3d")
    content = (tmp_path / "b.c3d").read_bytes()
    for size in (100, 700, len(content) // 2, len(content) - 4000):
        (tmp_path / "c.c3d").write_bytes(content[:size])
        with pytest.raises(UserError, match=r"truncated|damaged"):
            c3d.read(tmp_path / "c.c3d")


@pytest.mark.parametrize("seed", range(12))
def test_a_damaged_file_is_read_completely_or_rejected(tmp_path, seed):
    draw = np.random.default_rng(seed)
    c3d.write(recording(), tmp_path / "a.c3d")
    content = bytearray((tmp_path / "a.c3d").read_bytes())
    for place in draw.integers(2, 2500, 3):
        content[place] = draw.integers(0, 256)
    (tmp_path / "b.c3d").write_bytes(content)
    try:
        names, places, fps = c3d.read(tmp_path / "b.c3d")
    except UserError:
        return
    assert places.shape[1:] == (len(names), 3)
    assert len(set(names)) == len(names)
    assert fps >= 1
    assert not np.isinf(places).any()


@pytest.mark.recorded
@pytest.mark.skipif(not ARM.is_file(), reason="needs the real recordings in ../shared/data/pyomeca_arm")
def test_a_real_file_has_its_units_gaps_and_rate():
    names, places, fps = c3d.read(ARM)
    assert (len(names), places.shape, fps) == (51, (580, 51, 3), 100.0)
    other = ezc3d.c3d(str(ARM))["data"]["points"][:3].transpose(2, 1, 0)
    assert other.shape == places.shape
    np.testing.assert_allclose(places, other / 1000, atol=1e-12)  # millimetres in the file; NaN where lost
    assert np.isnan(places).any(axis=2).sum() == 305
    body = np.array([name.startswith("Daphnee:") for name in names])
    assert 0.2 < np.nanmax(places[:, body, 2]) < 2.0  # the height of a person, z up

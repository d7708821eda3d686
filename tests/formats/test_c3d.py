"""C3D files are read again by us and by ezc3d alone; files without a unit are rejected."""

import struct
from pathlib import Path

import ezc3d
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
    names, places, fps, _ = c3d.read(tmp_path / "a.c3d")
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
        ({"RATE": [0.5]}, "a frame rate of 0.5 Hz"),
        ({"RATE": [10001.0]}, "a frame rate of 10001 Hz"),
    ],
)
def test_a_file_without_unit_names_or_rate_is_rejected(tmp_path, parameters, message):
    with pytest.raises(UserError, match=message):
        c3d.read(rewritten(tmp_path, **parameters))


def test_units_become_metres(tmp_path):
    given = recording()
    _, places, *_ = c3d.read(rewritten(tmp_path, UNITS=["cm"]))
    np.testing.assert_allclose(places, 10 * given.places_m, atol=1e-5)


ORDER = {84: "<", 85: "<", 86: ">"}
"""Byte order by processor type: Intel, DEC and MIPS."""


def numbers(processor, values, kind="f4"):
    """Numbers as a processor stores them."""
    stored = np.asarray(values).astype(ORDER[processor] + kind)
    if (processor, kind) != (85, "f4"):
        return stored.tobytes()
    halves = (stored * 4).view("<u2").reshape(-1, 2)  # VAX: exponent greater by 2, halves exchanged
    return halves[:, ::-1].tobytes()


def parameter(processor, group, name, value):
    """A parameter, or a group if ``value`` is None."""
    if value is None:
        body, group = b"", -group
    elif isinstance(value, list):
        value = [text.encode() for text in value]
        width = max(map(len, value))
        body = struct.pack("bBBB", -1, 2, width, len(value)) + b"".join(text.ljust(width) for text in value)
    elif np.asarray(value).dtype.kind == "f":
        body = struct.pack("bBB", 4, 1, len(value)) + numbers(processor, value)
    else:
        body = struct.pack("bBB", 2, 1, len(value)) + numbers(processor, value, "u2")
    offset = numbers(processor, [len(body) + 3], "u2")
    return struct.pack("bb", len(name), group) + name.encode() + offset + body + b"\0"


def c3d_bytes(points, processor=84, scale=-1.0, analog=0, header=None, fps=50.0, **changes):
    """A C3D file of ``points`` (T, M, 4), by hand; ``changes`` replace parameters of POINT and of TRIAL."""
    n_frames, n_markers, _ = points.shape
    point = {
        "USED": np.array([n_markers]), "SCALE": np.array([scale]), "RATE": np.array([fps]),
        "FRAMES": np.array([n_frames]), "UNITS": ["mm"],
    }  # fmt: skip
    names = [f"m{number}" for number in range(n_markers)]
    for start in range(0, n_markers, 255):
        point[f"LABELS{start // 255 + 1 if start else ''}"] = names[start : start + 255]
    trial = {name: value for name, value in changes.items() if name.startswith("ACTUAL")}
    point |= {name: value for name, value in changes.items() if name not in trial}
    section = parameter(processor, 1, "POINT", None) + parameter(processor, 2, "TRIAL", None)
    for group, named in ((1, point), (2, trial)):
        section += b"".join(parameter(processor, group, *item) for item in named.items() if item[1] is not None)
    section = struct.pack("BBBB", 1, 80, 0, processor) + section + b"\0\0"
    n_sections = -(-len(section) // 512)
    first, last = header or (1, n_frames)
    start = b"\x02\x50" + numbers(processor, [n_markers, analog, first, last, 10], "u2")
    start += numbers(processor, [scale]) + numbers(processor, [2 + n_sections, 1 if analog else 0], "u2")
    start += numbers(processor, [fps])
    stored = np.concatenate([points.reshape(n_frames, -1), np.full((n_frames, analog), 7.0)], axis=1)
    data = numbers(processor, stored.ravel(), "f4" if scale < 0 else "i2")
    return b"".join(part.ljust(-(-len(part) // 512) * 512, b"\0") for part in (start, section, data))


def read_bytes(tmp_path, content, **options):
    (tmp_path / "a.c3d").write_bytes(content)
    return c3d.read(tmp_path / "a.c3d", **options)


def some_points(n_frames=6, n_markers=4, seed=0):
    points = np.random.default_rng(seed).integers(1, 900, (n_frames, n_markers, 4)).astype(float)
    points[-1, -1, 3] = -1
    return points


@pytest.mark.parametrize("processor", ORDER)
@pytest.mark.parametrize("scale", [-1.0, 0.5])
@pytest.mark.parametrize("analog", [0, 5])
def test_the_numbers_of_every_processor_are_read(tmp_path, processor, scale, analog):
    points = some_points()
    names, places, fps, notes = read_bytes(tmp_path, c3d_bytes(points, processor, scale, analog))
    assert (names, fps, notes) == (("m0", "m1", "m2", "m3"), 50.0, ())
    expected = points[:, :, :3] * (0.001 if scale < 0 else 0.0005)
    expected[-1, -1] = np.nan
    np.testing.assert_allclose(places, expected, rtol=1e-6)


@settings(max_examples=60)
@given(
    n_frames=st.integers(1, 40), n_markers=st.integers(1, 300), analog=st.integers(0, 9),
    processor=st.sampled_from(sorted(ORDER)), scale=st.sampled_from([-1.0, 0.25]), seed=st.integers(0, 99),
)  # fmt: skip
def test_files_of_any_size_are_read_as_written(tmp_path_factory, n_frames, n_markers, analog, processor, scale, seed):
    points = some_points(n_frames, n_markers, seed)
    content = c3d_bytes(points, processor, scale, analog)
    names, places, fps, notes = read_bytes(tmp_path_factory.mktemp("c3d"), content)
    assert (len(names), fps, notes) == (n_markers, 50.0, ())
    expected = points[:, :, :3] * 0.001 * abs(scale)
    expected[-1, -1] = np.nan
    np.testing.assert_allclose(places, expected, rtol=1e-6)


def test_names_beyond_the_255th_are_in_further_lists(tmp_path):
    names, places, *_ = read_bytes(tmp_path, c3d_bytes(some_points(2, 600)))
    assert names == tuple(f"m{number}" for number in range(600))
    assert places.shape == (2, 600, 3)


def test_more_frames_than_16_bits_can_count_are_read(tmp_path):
    points = np.ones((70000, 1, 4))
    saturated = {"header": (1, 65535), "FRAMES": np.array([65535])}
    in_trial = {"ACTUAL_START_FIELD": np.array([1, 0]), "ACTUAL_END_FIELD": np.array([70000 - 65536, 1])}
    for stated in (in_trial, {"LONG_FRAMES": np.array([70000.0])}):
        assert len(read_bytes(tmp_path, c3d_bytes(points, **saturated, **stated)).places_m) == 70000
    with pytest.raises(UserError, match=r"a\.c3d: announces 65535 in POINT:FRAMES and 65535 in the header, but its"):
        read_bytes(tmp_path, c3d_bytes(points, **saturated))
    late = {
        "header": (65535, 65535),
        "ACTUAL_START_FIELD": np.array([14464, 1]),
        "ACTUAL_END_FIELD": np.array([14469, 1]),
    }
    for header in ((65535, 65535), (1, 65535)):
        assert len(read_bytes(tmp_path, c3d_bytes(points[:6], **late | {"header": header})).places_m) == 6


def test_frames_40000_to_65000_are_read(tmp_path):
    points = np.ones((40000, 1, 4))  # negative as signed 16 bits
    content = c3d_bytes(points)
    assert len(read_bytes(tmp_path, content).places_m) == 40000
    assert len(read_bytes(tmp_path, content + bytes(1024)).places_m) == 40000


def test_counts_of_frames_that_contradict_the_data_are_rejected(tmp_path):
    points = some_points(30, 40)
    with pytest.raises(UserError, match=r"announces 30 in POINT:FRAMES and 65535 in the header, .* room for 30"):
        read_bytes(tmp_path, c3d_bytes(points, header=(1, 65535)))
    with pytest.raises(UserError, match="announces 50 frames and holds 30"):
        read_bytes(tmp_path, c3d_bytes(points, header=(1, 50), FRAMES=np.array([50])))
    with pytest.raises(UserError, match=r"announces 20 in POINT:FRAMES and 10 in the header, .* room for 30 frames"):
        read_bytes(tmp_path, c3d_bytes(points, header=(1, 10), FRAMES=np.array([20])))


def test_markers_may_share_a_name_and_unnamed_ones_are_left_out(tmp_path):
    points = some_points()
    found = read_bytes(tmp_path, c3d_bytes(points, LABELS=["a", "b", "", "a"]))
    assert found.names == ("a", "b", "a")
    np.testing.assert_allclose(found.places_m[:5, 2], points[:5, 3, :3] / 1000)
    with pytest.raises(UserError, match="has 4 markers with 0 names"):
        read_bytes(tmp_path, c3d_bytes(points, LABELS=None))


def test_names_in_either_unicode_composition_are_the_same(tmp_path):
    found = read_bytes(tmp_path, c3d_bytes(some_points(n_markers=1), LABELS=["e\u0301paule "]))
    assert found.names == ("\u00e9paule",)


def test_a_declared_unit_replaces_that_of_the_file(tmp_path):
    points = some_points()
    found = read_bytes(tmp_path, c3d_bytes(points, UNITS=["furlong"]), unit=0.056444)
    np.testing.assert_allclose(found.places_m[0], points[0, :, :3] * 0.056444)
    assert found.notes == ("unit 'furlong' of the file replaced by the declared 0.056444 m",)
    assert read_bytes(tmp_path, c3d_bytes(points, UNITS=["MM"]), unit="mm").notes == ()
    with pytest.raises(
        UserError, match=r"state it in corpus.markers.unit as one of m, cm, mm, in, inch, or in metres"
    ):
        read_bytes(tmp_path, c3d_bytes(points, UNITS=["furlong"]))


def test_a_rate_in_single_precision_is_that_of_television(tmp_path):
    assert read_bytes(tmp_path, c3d_bytes(some_points(), fps=59.94)).fps == 59.94


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (c3d_bytes(some_points(), scale=-1.0)[:1000], "is truncated before its parameters; copy"),
        (c3d_bytes(some_points()).replace(b"LABELS", b"LIBELS"), "has 4 markers with 0 names"),
        (c3d_bytes(some_points()).replace(b"\x01\x50\x00\x54", b"\x01\x50\x00\x99"), "unknown processor type 153"),
        (c3d_bytes(some_points(), DATA_START=np.array([0])), "does not say where its data begin"),
        (c3d_bytes(some_points(), SCALE=np.array([0.0])), "has the scale 0"),
        (c3d_bytes(some_points(), USED=np.array([0])), "has 0 markers"),
    ],
)
def test_malformed_files_are_rejected_with_the_reason(tmp_path, content, message):
    with pytest.raises(UserError, match=message):
        read_bytes(tmp_path, content)


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
        with pytest.raises(UserError, match=r"truncated.*copy"):
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
        names, places, fps, _ = c3d.read(tmp_path / "b.c3d")
    except UserError:
        return
    assert places.shape[1:] == (len(names), 3)
    assert all(names)
    assert fps >= 1
    assert not np.isinf(places).any()


@pytest.mark.recorded
@pytest.mark.skipif(not ARM.is_file(), reason="needs the real recordings in ../shared/data/pyomeca_arm")
def test_a_real_file_has_its_units_gaps_and_rate():
    names, places, fps, _ = c3d.read(ARM)
    assert (len(names), places.shape, fps) == (51, (580, 51, 3), 100.0)
    other = ezc3d.c3d(str(ARM))["data"]["points"][:3].transpose(2, 1, 0)
    assert other.shape == places.shape
    np.testing.assert_allclose(places, other / 1000, atol=1e-12)  # millimetres in the file; NaN where lost
    assert np.isnan(places).any(axis=2).sum() == 305
    body = np.array([name.startswith("Daphnee:") for name in names])
    assert 0.2 < np.nanmax(places[:, body, 2]) < 2.0  # the height of a person, z up

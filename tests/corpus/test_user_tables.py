"""Tables of other programs are read without our metadata and validated against our names, units and ranges."""

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.corpus import user_tables
from cospeech.data import segments, tables, vocabulary
from cospeech.errors import UserError
from cospeech.motion import skeleton

LABELS = list(vocabulary.GESTURES)


def motion_table(n_frames=40, fps=25.0):
    rng = np.random.default_rng(0)
    angles = rng.uniform(-30, 30, (n_frames, len(skeleton.JOINTS), 3))
    return skeleton.motion_table(rng.normal(0, 0.1, (n_frames, 3)), angles, fps)


def prosody_table(n_frames=80):
    rng = np.random.default_rng(1)
    table = pd.DataFrame({"frame": np.arange(n_frames), "time_s": segments.frame_times(n_frames, 40.0)})
    for name in ("intensity", "pitch_lag", "pitch_gain", "d_intensity", "d_pitch_lag", "d_pitch_gain"):
        table[name] = rng.uniform(-1, 1, n_frames)
    return table


def gesture_table(record="a"):
    starts, labels = [0, 10, 25, 40], ["rest", "left", "left", "open"]
    return segments.from_starts(record, starts, labels, 60, 20.0)


def save(table, path):
    if path.suffix == ".csv":
        table.to_csv(path, index=False)
    else:
        table.to_parquet(path)
    return path


@pytest.mark.parametrize("name", ["a.csv", "a.parquet"])
def test_motion_of_another_program_is_read_unchanged(tmp_path, name):
    table, notes = user_tables.motion(save(motion_table(), tmp_path / name))
    np.testing.assert_allclose(table.to_numpy(), motion_table().to_numpy())
    assert notes == []


def test_times_may_be_frame_starts_and_frames_may_start_at_any_number(tmp_path):
    shifted = motion_table().assign(frame=np.arange(40) + 100, time_s=np.arange(40) / 25 + 4)
    table, _ = user_tables.motion(save(shifted, tmp_path / "a.csv"))
    np.testing.assert_allclose(table.to_numpy(), motion_table().to_numpy())


def test_missing_joints_have_zero_angles_and_are_noted(tmp_path):
    arms = motion_table()[["frame", "time_s", *skeleton.ROOT_COLUMNS, *skeleton.angle_columns(skeleton.ARM_JOINTS)]]
    table, notes = user_tables.motion(save(arms, tmp_path / "a.parquet"))
    assert (table[skeleton.angle_columns(("head", "left_foot"))] == 0).all(axis=None)
    assert "head" in notes[0]


def with_nan(table, column, row):
    table.loc[row, column] = np.nan
    return table


@pytest.mark.parametrize(
    ("corrupt", "message"),
    [
        (lambda t: t.drop(columns="root_x_m"), "column 'root_x_m' is missing"),
        (lambda t: t.rename(columns={"root_x_m": "root_x_cm"}), "'root_x_m' is missing; if it is 'root_x_cm'"),
        (lambda t: t.rename(columns={"left_arm_x_deg": "left_arm_x_rad"}), "if it is 'left_arm_x_rad'"),
        (lambda t: t.rename(columns={"head_x_deg": "haed_x_deg"}), "unknown joint column 'haed_x_deg'.*'head_x_deg'"),
        (
            lambda t: with_nan(t, "right_arm_y_deg", 7),
            "joint 'right_arm' is missing .NaN. or not a number in frame 7",
        ),
        (lambda t: with_nan(t, "root_z_m", 3), "column 'root_z_m' is missing .NaN. or not a number in frame 3"),
        (lambda t: t.astype({"left_arm_x_deg": str}).replace("x", "y").assign(left_arm_x_deg="abc"), "'left_arm'"),
        (lambda t: t.drop(index=12), "missing or not uniform at row"),
        (lambda t: t.assign(time_s=t["time_s"] ** 2), "not uniform"),
        (lambda t: t.assign(time_s=0.0), "not uniform"),
        (lambda t: t.iloc[:1], "contains only 1 frame"),
        (lambda t: t.iloc[:0], "contains only 0 frame"),
        (lambda t: t.assign(**{name: t[name] / 57.3 for name in t if name.endswith("_deg")}), "radians"),
        (lambda t: t.assign(root_y_m=95.0), "convert to metres"),
    ],
)
@pytest.mark.parametrize("name", ["bad.csv", "bad.parquet"])
def test_invalid_motion_is_rejected_in_one_line(tmp_path, name, corrupt, message):
    with pytest.raises(UserError, match=message) as caught:
        user_tables.motion(save(corrupt(motion_table()), tmp_path / name))
    assert name in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_a_stated_unit_that_is_not_ours_is_refused(tmp_path):
    arrow = pa.Table.from_pandas(motion_table(), preserve_index=False)
    fields = [field.with_metadata({b"unit": b"cm"}) if field.name == "root_x_m" else field for field in arrow.schema]
    pq.write_table(arrow.cast(pa.schema(fields)), tmp_path / "bad.parquet")
    with pytest.raises(UserError, match="'root_x_m' is in 'cm', expected 'm'"):
        user_tables.motion(tmp_path / "bad.parquet")


def test_the_checksum_of_our_tables_is_verified(tmp_path):
    path = tmp_path / "a.parquet"
    tables.write(motion_table(), path, "motion", corpus="x", config_hash="0")
    user_tables.motion(path)
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 4
    path.write_bytes(content)
    with pytest.raises(UserError, match="damaged"):
        user_tables.motion(path)


@pytest.mark.parametrize("name", ["a.csv", "a.parquet"])
def test_prosody_needs_no_raw_columns(tmp_path, name):
    table = user_tables.prosody(save(prosody_table(), tmp_path / name), 0.025)
    tables.validate(table, "prosody", "user")
    np.testing.assert_allclose(table["pitch_lag"], prosody_table()["pitch_lag"])
    assert table["lag_s"].isna().all()


@pytest.mark.parametrize(
    ("corrupt", "message"),
    [
        (lambda t: t.drop(columns="d_pitch_gain"), "'d_pitch_gain' is missing"),
        (lambda t: t.assign(time_s=t["time_s"] / 2), "frame period is 0.0125 s, but speech.frame_s is 0.025"),
        (lambda t: with_nan(t, "intensity", 5), "'intensity' is missing .NaN. or not a number in frame 5"),
        (lambda t: t.assign(intensity=0.0), "is constant"),
        (lambda t: t.assign(pitch_gain=t["pitch_gain"] * 3), "pitch_gain.*outside"),
    ],
)
def test_invalid_prosody_is_rejected_in_one_line(tmp_path, corrupt, message):
    with pytest.raises(UserError, match=message) as caught:
        user_tables.prosody(save(corrupt(prosody_table()), tmp_path / "bad.parquet"), 0.025)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("name", ["a.csv", "a.parquet"])
def test_gestures_are_selected_by_record(tmp_path, name):
    both = pd.concat([gesture_table("b"), gesture_table("a")], ignore_index=True)
    table = user_tables.gestures(save(both, tmp_path / name), "a", LABELS)
    pd.testing.assert_frame_equal(table, gesture_table("a"), check_dtype=False)
    alone = user_tables.gestures(save(gesture_table("named_otherwise"), tmp_path / name), "a", LABELS)
    pd.testing.assert_frame_equal(alone, gesture_table("a"), check_dtype=False)


@pytest.mark.parametrize(
    ("corrupt", "message"),
    [
        (
            lambda t: t.assign(label=["rest", "lefft", "left", "open"]),
            "segment 1: unknown label 'lefft'; did you mean",
        ),
        (lambda t: t.assign(end_frame=[10, 24, 40, 60]), "segment 1 .* leaves a gap"),
        (lambda t: t.assign(start_s=t["start_s"] * 2, end_s=t["end_s"] ** 1.5), "disagree"),
        (lambda t: t.iloc[1:], "starts at frame 10, not at 0"),
        (lambda t: t.assign(record=["x", "x", "y", "y"]), "no segment of record 'a'"),
        (lambda t: t.assign(start_frame=t["start_frame"] + 0.5), "start_frame"),
    ],
)
def test_invalid_gestures_are_rejected_in_one_line(tmp_path, corrupt, message):
    with pytest.raises(UserError, match=message) as caught:
        user_tables.gestures(save(corrupt(gesture_table()), tmp_path / "bad.parquet"), "a", LABELS)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("content", [b"", b"PAR1 no more", b"\xff\xfe\x00\x01", b"frame,time_s\n1,2,3,4\n", b'"'])
@pytest.mark.parametrize("name", ["bad.csv", "bad.parquet"])
def test_damaged_files_are_rejected(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    for read in (
        user_tables.motion,
        lambda path: user_tables.prosody(path, 0.025),
        lambda path: user_tables.gestures(path, "a", LABELS),
    ):
        with pytest.raises(UserError, match=name):
            read(tmp_path / name)
        with pytest.raises(UserError, match="no such file"):
            read(tmp_path / f"none_{name}")


@settings(max_examples=80, deadline=None)
@given(st.data())
def test_a_corrupted_csv_file_is_either_read_or_rejected(tmp_path_factory, data):
    lines = gesture_table().to_csv(index=False).splitlines()
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(lines) - 1))
        cells = lines[at].split(",")
        cells[data.draw(st.integers(0, len(cells) - 1))] = data.draw(
            st.text(max_size=6) | st.floats().map(str) | st.integers().map(str)
        )
        lines[at] = ",".join(cells)
    path = tmp_path_factory.mktemp("corrupted") / "gestures.csv"
    path.write_text("\n".join(lines), encoding="utf-8", errors="surrogatepass")
    try:
        table = user_tables.gestures(path, "a", LABELS)
    except UserError:
        return
    segments.check(table, "gestures")
    assert set(table["label"]) <= set(LABELS)


def test_tables_beyond_the_limit_are_rejected_before_they_are_read(tmp_path):
    flat = pa.table({"frame": pa.array(np.zeros(70_000_000, dtype=np.int8))})
    pq.write_table(flat, tmp_path / "bomb.parquet")  # a few kilobytes
    with pytest.raises(UserError, match=r"bomb\.parquet: has 560 MB, more than the limit of 512 MB"):
        user_tables.motion(tmp_path / "bomb.parquet")

"""Tables of other programs are read without our metadata and validated against our names, units and ranges."""

import re
import runpy
import sys

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import soundfile
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.corpus import user_tables
from cospeech.data import segments, tables, vocabulary
from cospeech.errors import UserError
from cospeech.kernels import code_hash
from cospeech.motion import skeleton
from cospeech.speech import prosody

ROOT = code_hash.PACKAGE.parents[1]
LABELS = list(vocabulary.GESTURES)


def motion_table(n_frames=40, fps=25.0):
    rng = np.random.default_rng(0)
    angles = rng.uniform(-30, 30, (n_frames, len(skeleton.JOINTS), 3))
    return skeleton.motion_table(rng.normal(0, 0.1, (n_frames, 3)), angles, fps)


def prosody_table(n_frames=80):
    rng = np.random.default_rng(1)
    table = pd.DataFrame({"frame": np.arange(n_frames), "time_s": segments.frame_times(n_frames, 40.0)})
    voiced = rng.random(n_frames) < 0.6
    lag = np.where(voiced, rng.normal(0.008, 0.001, n_frames), 0.0)
    intensity = rng.normal(0, 1, n_frames)
    table["intensity"] = (intensity - intensity.mean()) / intensity.std()
    table["pitch_lag"] = np.where(voiced, lag - lag[voiced].mean(), 0.0)
    table["pitch_gain"] = np.where(voiced, rng.uniform(0.4, 1.0, n_frames), 0.0)
    return differentiated(table)


def differentiated(table, how=lambda values: np.diff(values, prepend=values[0])):
    names = ("intensity", "pitch_lag", "pitch_gain")
    return table.assign(**{f"d_{name}": how(table[name].to_numpy()) for name in names})


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
    shifted = motion_table().assign(frame=np.arange(40) + 100, time_s=np.arange(40) / 25)
    table, _ = user_tables.motion(save(shifted, tmp_path / "a.csv"))
    np.testing.assert_allclose(table.to_numpy(), motion_table().to_numpy())


@pytest.mark.parametrize("fps", [24, 25, 30, 30 / 1.001, 100, 120])
def test_times_rounded_to_milliseconds_keep_the_frame_rate(tmp_path, fps):
    table, _ = user_tables.motion(save(motion_table(300, fps).round({"time_s": 3}), tmp_path / "a.csv"))
    np.testing.assert_allclose(table["time_s"], segments.frame_times(300, fps))
    cut = motion_table(300, fps).round({"time_s": 3}).drop(index=7)
    with pytest.raises(UserError, match="missing or not uniform"):
        user_tables.motion(save(cut, tmp_path / "bad.csv"))


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
        (lambda t: t.assign(time_s=t["time_s"] + 5), "first frame is at 5.02 s, so the frames before it are missing"),
        (lambda t: t.assign(time_s=t["time_s"] - 1), "first frame is at -0.98 s"),
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
        (lambda t: t.assign(pitch_gain=t["pitch_gain"] * 3), "'pitch_gain' reaches 2.9.*expected -1 to 1"),
        (
            lambda t: t.assign(time_s=t["time_s"] + 5),
            "first frame is at 5.0125 s, so the frames before it are missing",
        ),
        (
            lambda t: differentiated(t.assign(intensity=60 + 8 * t["intensity"])),
            "has mean 60 and standard deviation 8,",
        ),
        (lambda t: differentiated(t.assign(intensity=t["intensity"] / 10)), "'intensity' has mean .* deviation 0.1,"),
        (
            lambda t: differentiated(t.assign(pitch_lag=t["pitch_lag"] * 1000)),
            "'pitch_lag' reaches .*at most 0.025 s",
        ),
        (lambda t: differentiated(t.assign(pitch_lag=120 - 1e4 * t["pitch_lag"])), r"'pitch_lag' reaches 1\d\d"),
        (
            lambda t: differentiated(t.assign(pitch_lag=np.where(t["pitch_gain"] > 0, t["pitch_lag"] + 0.008, 0))),
            "'pitch_lag' is never negative .mean 0.00[78]",
        ),
        (
            lambda t: t.assign(d_intensity=t["d_intensity"] * 40),
            "'d_intensity' is 40 times the change of 'intens",
        ),
        (
            lambda t: t.assign(d_pitch_lag=t["d_pitch_lag"] * 40),
            "'d_pitch_lag' is 40 times.*the previous frame, not per second",
        ),
        (lambda t: t.assign(d_pitch_gain=t["d_pitch_gain"] * 40), "'d_pitch_gain' is 40 times"),
        (lambda t: t.assign(d_pitch_gain=0.0), "'d_pitch_gain' is 0 times"),
    ],
)
def test_invalid_prosody_is_rejected_in_one_line(tmp_path, corrupt, message):
    with pytest.raises(UserError, match=message) as caught:
        user_tables.prosody(save(corrupt(prosody_table()), tmp_path / "bad.parquet"), 0.025)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    "change",
    [
        lambda t: differentiated(t, np.gradient),
        lambda t: t.round(3),
        lambda t: differentiated(t.assign(intensity=1.3 * t["intensity"] + 0.3)),
        lambda t: t.assign(d_pitch_lag=t["d_pitch_lag"].where(t["pitch_gain"] * t["pitch_gain"].shift() > 0, 0.0)),
        lambda t: differentiated(t.assign(pitch_lag=0.0)),
    ],
    ids=[
        "central differences",
        "rounded",
        "normalised over several records",
        "none where voicing starts",
        "monotone",
    ],
)
def test_prosody_of_other_trackers_is_not_refused(tmp_path, change):
    table = change(prosody_table(400))
    np.testing.assert_allclose(
        user_tables.prosody(save(table, tmp_path / "a.csv"), 0.025)["d_pitch_lag"], table["d_pitch_lag"]
    )


def test_the_script_in_the_documentation_makes_a_table_that_agrees_with_ours(tmp_path, monkeypatch):
    """The script in docs/tables.md, run on a voice that glides, fades and pauses."""
    times_s = np.arange(6 * 16000) / 16000
    phase = 2 * np.pi * np.cumsum(180 + 40 * np.sin(2 * np.pi * 0.7 * times_s)) / 16000
    loudness = 0.05 * (1.2 + np.sin(2 * np.pi * times_s)) * (times_s % 2 < 1.6)
    samples = loudness * sum(np.sin(k * phase) / k for k in range(1, 9))
    samples += np.random.default_rng(3).normal(0, 1e-4, len(times_s))
    soundfile.write(tmp_path / "talk.wav", samples, 16000)
    page = (ROOT / "docs/tables.md").read_text(encoding="utf-8")
    (tmp_path / "script.py").write_text(re.search(r"```python\n(.*?)```", page, re.DOTALL)[1], encoding="utf-8")
    arguments = [str(tmp_path / name) for name in ("script.py", "talk.wav", "talk.csv")]
    monkeypatch.setattr(sys, "argv", arguments)
    runpy.run_path(arguments[0], run_name="__main__")
    table = user_tables.prosody(arguments[2], 0.025)
    frames = prosody.measure(samples, 16000, frame_s=0.025, window_s=0.05, pitch_min_hz=60, pitch_max_hz=400)
    ours = prosody.features(frames, prosody.statistics("a", frames, 0.4), 0.025)
    assert len(table) == len(ours) == 240
    voiced = (table["pitch_lag"] != 0) & (ours["pitch_gain"] > 0.4)
    assert 150 < voiced.sum() < 200
    inside = voiced & voiced.shift(fill_value=False)
    for name in ("intensity", "pitch_lag", "d_intensity", "d_pitch_lag"):
        assert np.corrcoef(table[name][inside], ours[name][inside])[0, 1] > 0.99, name
    assert np.corrcoef(table["pitch_gain"], ours["pitch_gain"])[0, 1] > 0.95


@pytest.mark.parametrize(
    ("first", "separator", "decimal"), [("", ";", ","), ("sep=;\n", ";", ","), ("", ";", "."), ("", "\t", ",")]
)
@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_csv_tables_of_spreadsheets_are_read(tmp_path, first, separator, decimal, encoding):
    table = prosody_table()
    text = first + table.to_csv(index=False, sep=separator, decimal=decimal)
    (tmp_path / "a.csv").write_text(text, encoding=encoding)
    np.testing.assert_allclose(user_tables.prosody(tmp_path / "a.csv", 0.025)["d_pitch_lag"], table["d_pitch_lag"])


@pytest.mark.parametrize("name", ["a.csv", "a.parquet"])
def test_a_record_called_1_is_found_though_the_column_holds_numbers(tmp_path, name):
    both = pd.concat([gesture_table("1"), gesture_table("2").assign(label="rest")]).astype({"record": int})
    assert (
        user_tables.gestures(save(both, tmp_path / name), "1", LABELS)["label"].tolist()
        == gesture_table()["label"].tolist()
    )


@pytest.mark.parametrize("name", ["a.csv", "a.parquet"])
def test_start_end_and_label_of_gestures_are_enough(tmp_path, name):
    plain = pd.DataFrame(
        {"start_s": [0.0, 2.0004, 0.5], "end_s": [0.5, 3.21, 2.0], "label": ["rest", "open", "left"]}
    )
    table = user_tables.gestures(save(plain, tmp_path / name), "a", LABELS)
    tables.validate(table, "segments", "a")
    assert list(zip(table["start_s"], table["end_s"], table["label"], strict=True)) == [
        (0.0, 0.5, "rest"), (0.5, 2.0, "left"), (2.0, 3.21, "open")
    ]  # fmt: skip
    assert set(table["record"]) == {"a"}


def test_gestures_with_frames_whose_times_are_no_seconds_are_rejected(tmp_path):
    table = pd.DataFrame(
        {"start_frame": [0], "end_frame": [20], "start_s": [0.0], "end_s": [2**31], "label": ["rest"]}
    )
    with pytest.raises(UserError, match=r"its times exceed 1e.06 s; convert them to seconds"):
        user_tables.gestures(save(table, tmp_path / "bad.csv"), "a", LABELS)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([(0, 1e18, "rest")], "its times exceed 1e.06 s"),
        ([(5, 6, "rest")], "first segment starts at 5.000 s, not at 0"),
        ([(0, 1, "rest"), (1.5, 2, "left")], "segment 0, 'rest' at 0.000-1.000 s, leaves a gap to the next one"),
        ([(0, 1, "rest"), (0.9, 2, "left")], "segment 0, 'rest' at 0.000-1.000 s, overlaps the next one"),
        ([(0, 1, "rest"), (1, 1, "left")], "segment 1, 'left' at 1.000-1.000 s, is empty"),
        ([(0, 2, "rest"), (2, 1, "left")], "segment 1, 'left' at 2.000-1.000 s, ends before it starts"),
        ([(0, np.nan, "rest")], "'end_s' is missing .NaN. or not a number in segment 0"),
        ([(0, 1, "rset")], "segment 0: unknown label 'rset'; did you mean 'rest'"),
    ],
)
def test_gestures_that_do_not_cover_the_record_are_rejected(tmp_path, rows, message):
    table = pd.DataFrame(rows, columns=["start_s", "end_s", "label"])
    with pytest.raises(UserError, match=message):
        user_tables.gestures(save(table, tmp_path / "bad.csv"), "a", LABELS)


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


def syllable_table(**columns):
    given = {
        "start_s": [0.1, 0.4, 0.7],
        "peak_s": [0.2, 0.5, 0.8],
        "end_s": [0.3, 0.6, 0.9],
        "known_s": [0.35, 0.65, 0.95],
        "f0_hz": [180.0, np.nan, 200.0],
        "intensity_db": [-30.0, -36.0, -31.0],
    }
    return pd.DataFrame(given | columns)


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_syllables_are_read_with_the_columns_that_are_known(tmp_path, suffix):
    path = tmp_path / f"s.{suffix}"
    given = syllable_table()
    given.to_csv(path, index=False) if suffix == "csv" else given.to_parquet(path)
    read = user_tables.syllables(path, "a")
    tables.validate(read, "syllables", "a")
    assert read["record"].tolist() == ["a"] * 3
    assert read["syllable"].tolist() == [0, 1, 2]
    np.testing.assert_array_equal(read["f0_hz"], given["f0_hz"])
    assert read["f0_rise_hz"].isna().all()


def test_only_the_syllables_of_the_record_are_read(tmp_path):
    path = tmp_path / "s.csv"
    syllable_table(record=["a", "b", "b"]).to_csv(path, index=False)
    assert user_tables.syllables(path, "b")["start_s"].tolist() == [0.4, 0.7]


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"peak_s": [0.2, 0.65, 0.8]}, "syllable 1 (0.400-0.600 s, peak at 0.650 s) does not contain its peak"),
        ({"end_s": [0.5, 0.6, 0.9]}, "syllable 0 (0.100-0.500 s, peak at 0.200 s)"),
        ({"intensity_db": [-30.0, np.nan, -31.0]}, "column 'intensity_db' is missing (NaN) or not a number"),
        ({"f0_hz": [-1.0, 100.0, 100.0]}, "outside"),
    ],
)
def test_impossible_syllables_are_refused(tmp_path, columns, message):
    path = tmp_path / "s.csv"
    syllable_table(**columns).to_csv(path, index=False)
    with pytest.raises(UserError) as error:
        user_tables.syllables(path, "a")
    assert message in str(error.value)
    assert "\n" not in str(error.value)

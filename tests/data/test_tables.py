"""Tables are complete or absent, describe themselves, and a flipped bit is noticed."""

import errno
import os
import re
import subprocess
import sys
from dataclasses import fields

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from cospeech.data import tables
from cospeech.errors import UserError

ANNOTATIONS = pd.DataFrame(
    {
        "record": ["a", "a"],
        "start_s": [0.0, 1.5],
        "end_s": [1.0, 2.0],
        "gesture": ["rest", "left"],
        "origin": ["person", "rule"],
    }
)


def write(frame, path, schema="annotations"):
    tables.write(frame, path, schema, corpus="virtual", config_hash="0" * 16)


def test_round_trip_keeps_values_nulls_and_origin(tmp_path):
    frame = pd.DataFrame(
        {
            "actor": ["x"], "record": ["a"], "scenario": [None], "language": ["Turkish"],
            "motion_source": ["bvh"], "motion_fps": [20.0], "audio_rate_hz": [np.nan], "duration_s": [60.0],
            "motion_path": ["a.bvh"], "audio_path": [None], "note": [None],
            "head_source": [None], "head_fps": [None],
        }
    )  # fmt: skip
    write(frame, tmp_path / "r.parquet", "records")
    back = tables.read(tmp_path / "r.parquet", "records")
    pd.testing.assert_frame_equal(
        back.astype(object).where(back.notna(), None), frame.astype(object).where(frame.notna(), None)
    )
    assert tables.read_metadata(tmp_path / "r.parquet") == {
        "schema": "records", "schema_version": "1", "corpus": "virtual", "config_hash": "0" * 16,
    }  # fmt: skip
    # A null in the file, not a NaN that other programs take for a number.
    assert pq.read_table(tmp_path / "r.parquet")["audio_rate_hz"].null_count == 1


def test_same_table_same_bytes(tmp_path):
    write(ANNOTATIONS, tmp_path / "one.parquet")
    write(ANNOTATIONS[ANNOTATIONS.columns[::-1]], tmp_path / "two.parquet")
    assert (tmp_path / "one.parquet").read_bytes() == (tmp_path / "two.parquet").read_bytes()


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda t: t.drop(columns="gesture"), "column 'gesture' is missing"),
        (lambda t: t.rename(columns={"start_s": "start_ms"}), "column 'start_s' is missing"),
        (lambda t: t.assign(speed=1.0), "unknown column 'speed'"),
        (lambda t: t.assign(start_s=[-1.0, 0.0]), "row 0 is -1.0, outside"),
        (lambda t: t.assign(start_s=[0.0, np.nan]), "row 1 is missing"),
        (lambda t: t.assign(end_s=["a", "b"]), "where numbers"),
        (lambda t: t.assign(end_s=[1.0, np.inf]), "row 1 is inf"),
        (lambda t: t.assign(origin=["person", "robot"]), "unknown value 'robot'"),
        (lambda t: t.assign(start_s=[0.0, 0.0]), "row 1 repeats the key"),
    ],
)
def test_violations_of_a_schema_are_rejected_and_nothing_is_written(tmp_path, change, complaint):
    path = tmp_path / "t.parquet"
    with pytest.raises(UserError, match=complaint) as caught:
        write(change(ANNOTATIONS), path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_every_flipped_byte_is_noticed(tmp_path):
    path = tmp_path / "t.parquet"
    write(ANNOTATIONS, path)
    whole = path.read_bytes()
    expected = tables.read(path, "annotations")
    silent = []
    for place in range(len(whole)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x10]) + whole[place + 1 :])
        try:
            read = tables.read(path, "annotations")
        except (UserError, KeyError):
            continue
        if not read.equals(expected):
            silent.append(place)
    assert silent == []


@pytest.mark.parametrize("size", [0, 3, 200])
def test_truncated_and_foreign_files_are_named(tmp_path, size):
    path = tmp_path / "t.parquet"
    write(ANNOTATIONS, path)
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(UserError, match=r"t\.parquet: damaged or not a Parquet file"):
        tables.read(path, "annotations")


def test_wrong_schema_version_and_unit_are_named(tmp_path):
    path = tmp_path / "t.parquet"
    write(ANNOTATIONS, path)
    with pytest.raises(UserError, match="holds schema 'annotations'"):
        tables.read(path, "segments")
    arrow = pq.read_table(path)
    metres = pa.field("start_s", pa.float64(), nullable=False, metadata={b"unit": b"ms"})
    pq.write_table(arrow.cast(arrow.schema.set(1, metres)), path, write_page_checksum=True)
    with pytest.raises(UserError, match="column 'start_s' is in 'ms', expected 's'"):
        tables.read(path, "annotations")


def test_missing_file_says_what_to_do(tmp_path):
    with pytest.raises(UserError, match="no such file; run the workflow for it first"):
        tables.read(tmp_path / "t.parquet", "annotations")


def test_a_process_that_dies_while_writing_leaves_the_old_file(tmp_path):
    path = tmp_path / "t.txt"
    path.write_text("old")
    program = (
        "import os, sys; from cospeech.data.tables import replacing\n"
        "with replacing(sys.argv[1]) as temporary:\n"
        "    temporary.write_text('half'); os.kill(os.getpid(), 9)"
    )
    ended = subprocess.run([sys.executable, "-c", program, str(path)], check=False)
    assert ended.returncode == -9
    assert path.read_text() == "old"


def test_a_full_disk_is_one_message_and_leaves_nothing(tmp_path):
    with pytest.raises(UserError, match="the disk is full"), tables.replacing(tmp_path / "t.txt"):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert list(tmp_path.iterdir()) == []


@given(st.lists(st.tuples(st.floats(0, 1e6), st.text(max_size=8)), min_size=1, unique_by=lambda row: row[0]))
def test_any_valid_annotations_survive_the_file(tmp_path_factory, rows):
    frame = pd.DataFrame(
        {
            "record": "a",
            "start_s": [start for start, _ in rows],
            "end_s": [start + 1 for start, _ in rows],
            "gesture": [text for _, text in rows],
            "origin": "person",
        }
    )
    path = tmp_path_factory.mktemp("t") / "t.parquet"
    write(frame, path)
    back = tables.read(path, "annotations")
    assert back["start_s"].tolist() == frame["start_s"].tolist()
    assert back["gesture"].tolist() == frame["gesture"].tolist()


def test_every_schema_can_be_read():
    names = [path.stem for path in tables.schema_folder().glob("*.yaml") if path.stem != "config"]
    assert len(names) > 5
    for name in names:
        table = tables.schema(name)
        assert table.name == name
        known = {column.name for column in table.columns}
        assert set(table.key) <= known
        assert all(column.type in tables.ARROW_TYPES and column.meaning for column in table.columns)


@pytest.fixture
def package(tmp_path, monkeypatch):
    """The name of a package with a schema of its own."""
    monkeypatch.syspath_prepend(tmp_path / "site")
    folder = tmp_path / "site" / "package_with_schema"
    folder.mkdir(parents=True)
    (folder / "__init__.py").write_text("raise ImportError('a schema does not need its package')")
    text = "name: hops\nversion: 3\ntitle: Hops\ncolumns:\n  height_m: { type: float64, unit: m, meaning: height }\n"
    (folder / "hops.yaml").write_text(text)
    tables.schema.cache_clear()
    yield "package_with_schema"
    tables.schema.cache_clear()


def test_a_schema_can_lie_in_another_package(package, tmp_path):
    hops = pd.DataFrame({"height_m": [0.5, 0.25]})
    write(hops, tmp_path / "hops.parquet", f"{package}:hops")
    pd.testing.assert_frame_equal(tables.read(tmp_path / "hops.parquet", f"{package}:hops"), hops)
    found = tables.read_metadata(tmp_path / "hops.parquet")
    assert (found["schema"], found["schema_version"]) == (f"{package}:hops", "3")
    with pytest.raises(UserError, match=r"column 'height_m' is missing; a package_with_schema:hops table has"):
        write(hops.rename(columns={"height_m": "height"}), tmp_path / "x.parquet", f"{package}:hops")
    write(ANNOTATIONS, tmp_path / "annotations.parquet", f"{package}:annotations")  # that of cospeech
    assert tables.read_metadata(tmp_path / "annotations.parquet")["schema"] == "annotations"
    with pytest.raises(KeyError, match=r"no schema skips\.yaml"):
        tables.schema(f"{package}:skips")


def test_a_table_whose_package_is_not_installed_is_named(package, tmp_path, monkeypatch):
    path = tmp_path / "hops.parquet"
    write(pd.DataFrame({"height_m": [0.5]}), path, f"{package}:hops")
    monkeypatch.setattr(sys, "path", [folder for folder in sys.path if not folder.startswith(str(tmp_path))])
    tables.schema.cache_clear()
    message = f"{path}: schema '{package}:hops': no package '{package}' is installed; install it"
    with pytest.raises(UserError, match=re.escape(message)):
        tables.read(path, f"{package}:hops")


@pytest.mark.parametrize("name", ["no.such.package:hops", "..:hops", ".a:hops", "sys:hops", "pytest:../hops"])
def test_a_nonsensical_schema_is_refused(name):
    with pytest.raises((UserError, KeyError)):
        tables.schema(name)


@pytest.mark.parametrize("name", ["segments", "motion", "units", "decoding"])
def test_an_empty_table_is_valid(name, tmp_path):
    write(tables.empty(name), tmp_path / "empty.parquet", name)
    assert len(tables.read(tmp_path / "empty.parquet", name)) == 0


def plausible_row(schema):
    """Return a table of one row that follows the schema."""
    row = {}
    for column in schema.columns:
        low = -np.inf if column.minimum is None else column.minimum
        high = np.inf if column.maximum is None else column.maximum
        if column.values or column.type == "string":
            row[column.name] = [column.values[0] if column.values else "x"]
        elif column.type == "bool":
            row[column.name] = [False]
        else:
            row[column.name] = [np.clip(0, np.ceil(low) if column.type.startswith("int") else low, high)]
    return pd.DataFrame(row)


SCHEMAS = sorted(path.stem for path in tables.schema_folder().glob("*.yaml") if path.stem != "config")


@pytest.mark.parametrize("name", SCHEMAS)
def test_values_beyond_a_minimum_or_maximum_of_any_schema_are_rejected(name):
    schema = tables.schema(name)
    row = plausible_row(schema)
    tables.validate(row, name, "row")
    for column in schema.columns:
        for limit, step in ((column.minimum, -1), (column.maximum, 1)):
            if limit is not None:
                with pytest.raises(UserError, match=f"'{column.name}': row 0 is .*, outside"):
                    tables.validate(row.assign(**{column.name: limit + step}), name, "row")
                if limit == int(limit) or column.type == "float64":
                    tables.validate(row.assign(**{column.name: limit}), name, "row")


def test_a_limit_of_a_joint_angle_counts_like_that_of_a_column(monkeypatch):
    bounded = tables.Column("[a-z]+_deg", "float64", "angle", minimum=-180, maximum=180)
    schema = tables.Schema("bounded", 1, "", (), (), bounded)
    monkeypatch.setattr(tables, "schema", lambda name: schema)
    tables.validate(pd.DataFrame({"arm_deg": [-180.0, 180.0]}), "bounded", "x")
    for value in (-180.1, 180.1):
        with pytest.raises(UserError, match=r"'arm_deg': row 1 is .*, outside \[-180, 180\]"):
            tables.validate(pd.DataFrame({"arm_deg": [0.0, value]}), "bounded", "x")


def keys_without_value(node):
    if isinstance(node, list):
        return [key for child in node for key in keys_without_value(child)]
    if isinstance(node, dict):
        return [key for key, value in node.items() if value is None] + keys_without_value(list(node.values()))
    return []


def test_columns_have_only_known_keys_and_no_comma_cuts_a_description():
    # In a YAML flow mapping, an unquoted comma ends a text, and the rest of the text becomes a key without a value.
    known = {field.name for field in fields(tables.Column)}
    for path in tables.schema_folder().glob("*.yaml"):
        raw = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert keys_without_value(raw) == [], path.name
        for name, column in {**raw.get("columns", {}), "pattern": raw.get("pattern", {})}.items():
            assert set(column) <= known, f"{path.name}: {name}"

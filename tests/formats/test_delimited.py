"""Delimited files are read as spreadsheet programs mean them, or rejected with the line."""

import csv
import io

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cospeech.errors import UserError
from cospeech.formats import delimited, plain_text

COLUMNS = ("record", "start_s", "note")

cells = st.text(st.characters(exclude_categories=["Cc", "Cs", "Zl", "Zp"]), max_size=8)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(cells, cells, cells), max_size=6),
    st.sampled_from(",;\t|"),
    st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-32"]),
    st.sampled_from(["\n", "\r\n", "\r"]),
)
def test_any_cells_are_read_back_whatever_separates_them(tmp_path_factory, rows, separator, encoding, end):
    text = io.StringIO()
    csv.writer(text, delimiter=separator, lineterminator=end).writerows([COLUMNS, *rows])
    path = tmp_path_factory.mktemp("cells") / "a.csv"
    path.write_bytes(text.getvalue().encode(encoding))
    sheet = delimited.read(path, COLUMNS)
    assert sheet.separator == separator
    filled = [(line, [cell.strip() for cell in row]) for line, row in enumerate(rows, start=2)]
    assert [(row.line, list(row.cells.values())) for row in sheet.rows] == [
        (line, row) for line, row in filled if any(row)
    ]


@settings(max_examples=60, deadline=None)
@given(st.binary(max_size=200) | st.text(max_size=80).map(lambda text: ("record,start_s\n" + text).encode()))
def test_any_bytes_are_read_or_rejected_in_one_line(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("bytes") / "a.csv"
    path.write_bytes(content)
    message = None
    try:
        sheet = delimited.read(path, COLUMNS)
        assert len(delimited.parse_times(sheet, ["start_s"], path)) == len(sheet.rows)
    except UserError as error:
        message = str(error)
    assert message is None or (message.startswith(f"{path}: ") and len(message.splitlines()) == 1)


@given(st.integers(0, 10**8))
def test_a_time_is_the_same_in_every_format(milliseconds):
    seconds = milliseconds / 1000
    minutes, rest = divmod(milliseconds, 60000)
    clock = f"{minutes // 60}:{minutes % 60:02}:{rest / 1000:06.3f}"
    for text in (f"{seconds:.3f}", clock, f"{minutes}:{rest / 1000:06.3f}", f" {seconds:.9e} "):
        assert delimited.parse_seconds(text) == pytest.approx(seconds, abs=1e-9)
        assert delimited.parse_seconds(text.replace(".", ","), ";") == pytest.approx(seconds, abs=1e-9)


@pytest.mark.parametrize(
    "text",
    ["", "nan", "inf", "1_000", "1.234,5", "1,2,3", "0:61", "0:61:00", "1:2:3:4", "5 s", "٣", "1e", "-0:01", "1 2"],
)
@pytest.mark.parametrize("separator", [",", ";"])
def test_what_is_not_a_time_is_rejected(text, separator):
    with pytest.raises(ValueError, match=r"is not a number|is a time code|has a comma"):
        delimited.parse_seconds(text, separator)


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    with (tmp_path / "large.csv").open("wb") as file:
        file.truncate(plain_text.MAX_BYTES + 1)
    with pytest.raises(UserError, match="has 50 MB, more than the 50 MB"):
        delimited.read(tmp_path / "large.csv", COLUMNS)

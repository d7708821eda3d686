"""Annotations survive a round trip through ELAN and Praat; invalid ones are rejected with file, time and remedy."""

import xml.etree.ElementTree as ET

import numpy as np
import parselmouth
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from parselmouth.praat import call
from pympi import Elan

from cospeech.corpus import annotations
from cospeech.data import segments, tables, vocabulary
from cospeech.errors import UserError
from cospeech.formats import elan, textgrid

LABELS = list(vocabulary.GESTURES)
SPANS = [(0.0, 1.25, "rest"), (1.25, 2.5, "left"), (2.5, 4.0, "left"), (6.001, 7.333, "open")]
MEDIA = "../corpus/audio/a.wav"


def spans_of(table):
    return list(zip(table["start_s"], table["end_s"], table["gesture"], strict=True))


def write(path, spans=SPANS, duration_s=10.0):
    if path.suffix == ".eaf":
        elan.write(path, annotations.TIER, spans, LABELS, MEDIA)
    elif path.suffix == ".TextGrid":
        textgrid.write(path, annotations.TIER, spans, duration_s)
    else:
        rows = "".join(f"{start},{end},{label}\n" for start, end, label in spans)
        path.write_text(f"start_s,end_s,gesture\n{rows}", encoding="utf-8")
    return path


@pytest.mark.parametrize("name", ["a.eaf", "a.TextGrid", "a.csv"])
def test_written_spans_are_read_back_unchanged(tmp_path, name):
    table = annotations.read(write(tmp_path / name), "a", 10.0, LABELS)
    tables.validate(table, "annotations", name)
    assert spans_of(table) == SPANS
    assert set(table["origin"]) == {"person"}
    assert set(table["record"]) == {"a"}


@st.composite
def spans_and_length(draw, step_s=0.001):
    """Sorted, non-overlapping spans on a millisecond grid, and the duration of their record."""
    widths = draw(st.lists(st.tuples(st.integers(0, 3000), st.integers(1, 5000)), max_size=20))
    spans, now = [], 0
    for gap, width in widths:
        start, now = now + gap, now + gap + width
        spans.append((start * step_s, now * step_s, draw(st.sampled_from(LABELS))))
    return spans, max(now * step_s, 1.0) + draw(st.integers(0, 1000)) * step_s


@pytest.mark.parametrize("name", ["a.eaf", "a.TextGrid", "a.csv"])
@settings(max_examples=60, deadline=None)
@given(drawn=spans_and_length())
def test_any_spans_are_read_back_to_the_millisecond(tmp_path_factory, name, drawn):
    spans, duration_s = drawn
    path = write(tmp_path_factory.mktemp("spans") / name, spans, duration_s)
    back = spans_of(annotations.read(path, "a", duration_s, LABELS))
    assert [label for _, _, label in back] == [label for _, _, label in spans]
    times = np.array([(start, end) for start, end, _ in spans]).reshape(-1, 2)
    np.testing.assert_allclose(np.array([(s, e) for s, e, _ in back]).reshape(-1, 2), times, atol=1e-9)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(1, 200), min_size=1, max_size=30), st.floats(10, 120))
def test_segments_at_any_frame_rate_are_read_back_within_half_a_millisecond(tmp_path_factory, lengths, fps):
    folder = tmp_path_factory.mktemp("rate")
    starts = np.append(0, np.cumsum(lengths)[:-1])
    table = segments.from_starts("a", starts, np.array(LABELS)[np.arange(len(lengths)) % 7], sum(lengths), fps)
    spans, duration_s = annotations.segment_spans(table), float(table["end_s"].iloc[-1])
    for name in ("a.eaf", "a.TextGrid"):
        back = annotations.read(write(folder / name, spans, duration_s), "a", duration_s, LABELS)
        np.testing.assert_allclose(back[["start_s", "end_s"]], table[["start_s", "end_s"]], atol=0.00051)
        assert back["gesture"].tolist() == table["label"].tolist()
        assert back["end_s"].max() <= duration_s


def test_the_eaf_conforms_to_the_format(tmp_path):
    """The element order, ids and references required by EAFv2.8.xsd and ELAN."""
    root = ET.parse(write(tmp_path / "a.eaf")).getroot()
    assert root.tag == "ANNOTATION_DOCUMENT"
    assert {"AUTHOR", "DATE", "VERSION", "FORMAT"} <= set(root.attrib)
    order = (
        "LICENSE", "HEADER", "TIME_ORDER", "TIER", "LINGUISTIC_TYPE", "LOCALE", "LANGUAGE", "CONSTRAINT",
        "CONTROLLED_VOCABULARY", "LEXICON_REF", "REF_LINK_SET", "EXTERNAL_REF",
    )  # fmt: skip
    places = [order.index(child.tag) for child in root]
    assert places == sorted(places)
    assert root.find("HEADER").attrib["TIME_UNITS"] == "milliseconds"
    media = root.find("HEADER/MEDIA_DESCRIPTOR").attrib
    assert media == {"MEDIA_URL": MEDIA, "RELATIVE_MEDIA_URL": MEDIA, "MIME_TYPE": "audio/x-wav"}
    slots = {slot.attrib["TIME_SLOT_ID"]: int(slot.attrib["TIME_VALUE"]) for slot in root.find("TIME_ORDER")}
    assert len(slots) == len(root.find("TIME_ORDER"))
    assert list(slots.values()) == sorted(slots.values())
    (tier,) = root.findall("TIER")
    (kind,) = root.findall("LINGUISTIC_TYPE")
    assert tier.attrib["TIER_ID"] == annotations.TIER
    assert tier.attrib["LINGUISTIC_TYPE_REF"] == kind.attrib["LINGUISTIC_TYPE_ID"]
    (vocabulary,) = root.findall("CONTROLLED_VOCABULARY")
    assert kind.attrib["CONTROLLED_VOCABULARY_REF"] == vocabulary.attrib["CV_ID"]
    languages = {language.attrib["LANG_ID"] for language in root.findall("LANGUAGE")}
    values = vocabulary.findall("CV_ENTRY_ML/CVE_VALUE")
    assert [value.text for value in values] == LABELS
    assert {value.attrib["LANG_REF"] for value in values} <= languages
    spans = tier.findall("ANNOTATION/ALIGNABLE_ANNOTATION")
    numbers = [int(span.attrib["ANNOTATION_ID"].removeprefix("a")) for span in spans]
    assert len(set(numbers)) == len(SPANS)
    assert root.find("HEADER/PROPERTY[@NAME='lastUsedAnnotationId']").text == str(max(numbers))
    for span, (start, end, label) in zip(spans, SPANS, strict=True):
        assert slots[span.attrib["TIME_SLOT_REF1"]] == round(start * 1000)
        assert slots[span.attrib["TIME_SLOT_REF2"]] == round(end * 1000)
        assert span.find("ANNOTATION_VALUE").text == label


def test_without_sound_there_is_no_media_link(tmp_path):
    elan.write(tmp_path / "a.eaf", annotations.TIER, SPANS, LABELS, None)
    assert ET.parse(tmp_path / "a.eaf").getroot().find("HEADER/MEDIA_DESCRIPTOR") is None


def test_praat_reads_the_textgrid(tmp_path):
    grid = parselmouth.read(str(write(tmp_path / "a.TextGrid")))
    assert call(grid, "Get tier name", 1) == annotations.TIER
    assert call(grid, "Get total duration") == pytest.approx(10.0)
    found = [
        (call(grid, "Get start time of interval", 1, n), call(grid, "Get end time of interval", 1, n), label)
        for n in range(1, call(grid, "Get number of intervals", 1) + 1)
        if (label := call(grid, "Get label of interval", 1, n))
    ]
    assert found == SPANS


def test_a_textgrid_written_by_praat_is_read_and_its_points_are_ignored(tmp_path):
    grid = call("Create TextGrid", 0.0, 5.0, "gesture clicks", "clicks")
    call(grid, "Insert boundary", 1, 1.5)
    call(grid, "Set interval text", 1, 2, "left")
    call(grid, "Insert point", 2, 2.0, "click")
    for how in ("Save as text file", "Save as short text file"):
        call(grid, how, str(tmp_path / "a.TextGrid"))
        assert spans_of(annotations.read(tmp_path / "a.TextGrid", "a", 5.0, LABELS)) == [(1.5, 5.0, "left")]


def test_the_same_spans_give_the_same_bytes(tmp_path):
    for suffix in (".eaf", ".TextGrid"):
        for name in "ab":
            write(tmp_path / f"{name}{suffix}")
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()
    assert not list(tmp_path.glob("*.bak"))
    write(tmp_path / "a.eaf")  # overwrites the existing file
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.TextGrid", "a.eaf", "b.TextGrid", "b.eaf"]


@pytest.mark.parametrize(
    ("spans", "message"),
    [
        ([(0, 1, "Rest")], "'Rest' at 0.000-1.000 s: unknown label; did you mean 'rest'"),
        ([(0, 1, "dancing")], "unknown label; expected one of raise_both, rest"),
        ([(0, 2, "rest"), (1.999, 3, "left")], "'left' at 1.999-3.000 s: overlaps 'rest' at 0.000-2.000 s"),
        ([(9, 10.002, "rest")], "extends past the end of the record at 10.000 s"),
        ([(11, 12, "rest")], "extends past the end"),
    ],
)
@pytest.mark.parametrize("name", ["bad.eaf", "bad.csv"])
def test_invalid_spans_are_rejected(tmp_path, name, spans, message):
    with pytest.raises(UserError, match=message) as caught:
        annotations.read(write(tmp_path / name, spans, 20.0), "a", 10.0, LABELS)
    assert name in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_a_textgrid_longer_than_its_record_is_rejected(tmp_path):
    with pytest.raises(UserError, match=r"bad\.TextGrid: 'rest' at 9.000-11.000 s: extends past the end"):
        annotations.read(write(tmp_path / "bad.TextGrid", [(9, 11, "rest")], 20.0), "a", 10.0, LABELS)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("start,end_s,gesture\n0,1,rest\n", "column 'start_s' is missing"),
        ("start_s,end_s,gesture\n0,one,rest\n", "line 2: 'one' is not a number"),
        ("start_s,end_s,gesture\n0,1,rest,more\n", "line 2 does not have as many fields"),
        ("start_s,end_s,gesture\n0,1\n", "line 2 does not have as many fields"),
        ("start_s,end_s,gesture\n1,1,rest\n", "end after it starts"),
        ("start_s,end_s,gesture\n-1,1,rest\n", "end after it starts"),
        ("start_s,end_s,gesture\n0,nan,rest\n", "end after it starts"),
        ("", "column 'start_s' is missing"),
        ("\ufeffstart_s,end_s,gesture\n3,inf,rest\n", "end after it starts"),
    ],
)
def test_an_invalid_csv_file_is_rejected(tmp_path, text, message):
    (tmp_path / "bad.csv").write_text(text, encoding="utf-8")
    with pytest.raises(UserError, match=message):
        annotations.read(tmp_path / "bad.csv", "a", 10.0, LABELS)


def test_the_last_span_may_end_half_a_millisecond_late(tmp_path):
    table = annotations.read(write(tmp_path / "a.csv", [(0, 10.0004, "rest")]), "a", 10.0, LABELS)
    assert table["end_s"].iloc[0] == 10.0


def test_the_tier_named_gesture_is_read_from_a_file_with_several_tiers(tmp_path):
    document = Elan.Eaf()
    for tier in ("speech", "hands"):
        document.add_tier(tier)
        document.add_annotation(tier, 0, 1000, "left")
    document.to_file(tmp_path / "a.eaf")
    with pytest.raises(
        UserError, match=r"has the tiers speech, hands; rename the one with the gestures to 'gesture'"
    ):
        annotations.read(tmp_path / "a.eaf", "a", 10.0, LABELS)
    document.rename_tier("hands", "gesture")
    document.to_file(tmp_path / "b.eaf")
    assert spans_of(annotations.read(tmp_path / "b.eaf", "a", 10.0, LABELS)) == [(0.0, 1.0, "left")]
    document.remove_tiers(["speech", "gesture"])
    document.to_file(tmp_path / "c.eaf")
    empty = annotations.read(tmp_path / "c.eaf", "a", 10.0, LABELS)
    tables.validate(empty, "annotations", "c")
    assert len(empty) == 0


def test_unlabelled_spans_are_not_examples(tmp_path):
    spans = [(0.0, 1.0, ""), (1.0, 2.0, " rest "), (2.0, 3.0, "  ")]
    assert spans_of(annotations.read(write(tmp_path / "a.csv", spans), "a", 10.0, LABELS)) == [(1.0, 2.0, "rest")]


@pytest.mark.parametrize("content", [b"", b"<ANNOTATION_DOCUMENT", b"<x/>", b"\x00\x01", b"File type = nonsense"])
@pytest.mark.parametrize("name", ["bad.eaf", "bad.TextGrid", "bad.txt"])
def test_damaged_and_foreign_files_are_rejected(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UserError, match=name) as caught:
        annotations.read(tmp_path / name, "a", 10.0, LABELS)
    assert len(str(caught.value).splitlines()) == 1
    with pytest.raises(UserError, match="none"):
        annotations.read(tmp_path / f"none_{name}", "a", 10.0, LABELS)


def test_planted_examples_are_selected_by_record():
    planted = annotations.table("a", SPANS, 10.0, "studio")
    both = tables.pd.concat([annotations.table("b", SPANS, 10.0, "studio"), planted[::-1]], ignore_index=True)
    found = annotations.select_record(both, "a", 10.0, LABELS)
    assert spans_of(found) == SPANS
    assert set(found["origin"]) == {"studio"}
    assert len(annotations.select_record(None, "a", 10.0, LABELS)) == 0


@pytest.mark.parametrize("name", ["a.eaf", "a.TextGrid", "a.csv"])
@settings(max_examples=120, deadline=None)
@given(data=st.data())
def test_a_corrupted_file_is_either_read_or_rejected(tmp_path_factory, name, data):
    path = write(tmp_path_factory.mktemp("corrupted") / name)
    lines = path.read_text(encoding="utf-8").splitlines()
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(lines) - 1))
        kind = data.draw(st.sampled_from(["drop", "duplicate", "junk", "character"]))
        if kind == "drop" and len(lines) > 1:
            del lines[at]
        elif kind == "duplicate":
            lines.insert(at, lines[at])
        elif kind == "junk":
            lines[at] = data.draw(st.text(max_size=30))
        elif lines[at]:
            place = data.draw(st.integers(0, len(lines[at]) - 1))
            lines[at] = lines[at][:place] + data.draw(st.characters()) + lines[at][place + 1 :]
    path.write_text("\n".join(lines), encoding="utf-8", errors="surrogatepass")
    try:
        table = annotations.read(path, "a", 10.0, LABELS)
    except UserError:
        return
    tables.validate(table, "annotations", name)
    assert (table["end_s"] > table["start_s"]).all()
    assert (table["start_s"].to_numpy()[1:] >= table["end_s"].to_numpy()[:-1] - 1e-9).all()
    assert set(table["gesture"]) <= set(LABELS)

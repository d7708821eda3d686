"""Annotations survive a round trip through ELAN and Praat; invalid ones are rejected with file, time and remedy."""

import xml.etree.ElementTree as ET

import numpy as np
import pandas as pd
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


def read(path, duration_s=10.0, tier=None, **recording):
    return annotations.read(path, annotations.Recording("a", duration_s, **recording), LABELS, tier)


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
    table = read(write(tmp_path / name), 10.0)
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
    back = spans_of(read(path, duration_s))
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
        back = read(write(folder / name, spans, duration_s), duration_s)
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
        assert spans_of(read(tmp_path / "a.TextGrid", 5.0)) == [(1.5, 5.0, "left")]


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
        read(write(tmp_path / name, spans, 20.0), 10.0)
    assert name in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_a_textgrid_longer_than_its_record_is_rejected(tmp_path):
    with pytest.raises(
        UserError, match=r"bad\.TextGrid: tier 'gesture', interval 2: 'rest' at 9.000-11.000 s: extends past the end"
    ):
        read(write(tmp_path / "bad.TextGrid", [(9, 11, "rest")], 20.0), 10.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("start,end_s,gesture\n0,1,rest\n", "column 'start_s' is missing"),
        ("start_s,end_s,gesture\n0,one,rest\n", "line 2: end_s 'one' is not a number"),
        ("start_s,end_s,gesture\n0,1,rest,more\n", "line 2 has more cells than the header"),
        ("start_s,end_s,gesture\n0,1\n", "line 2 has nothing in column 'gesture'"),
        ("start_s,end_s,gesture\n1,1,rest\n", "end after it starts"),
        ("start_s,end_s,gesture\n-1,1,rest\n", "end after it starts"),
        ("start_s,end_s,gesture\n0,nan,rest\n", "line 2: end_s 'nan' is not a number"),
        ("", "column 'start_s' is missing"),
        ("\ufeffstart_s,end_s,gesture\n3,inf,rest\n", "end_s 'inf' is not a number"),
    ],
)
def test_an_invalid_csv_file_is_rejected(tmp_path, text, message):
    (tmp_path / "bad.csv").write_text(text, encoding="utf-8")
    with pytest.raises(UserError, match=message):
        read(tmp_path / "bad.csv", 10.0)


def test_the_last_span_may_end_half_a_millisecond_late(tmp_path):
    table = read(write(tmp_path / "a.csv", [(0, 10.0004, "rest")]), 10.0)
    assert table["end_s"].iloc[0] == 10.0


def test_the_tier_named_gesture_is_read_from_a_file_with_several_tiers(tmp_path):
    document = Elan.Eaf()
    for tier in ("speech", "hands"):
        document.add_tier(tier)
        document.add_annotation(tier, 0, 1000, "left")
    document.to_file(tmp_path / "a.eaf")
    with pytest.raises(
        UserError, match=r"has the tiers speech, hands; name the one with the gestures in corpus\.annotations\.tier"
    ):
        read(tmp_path / "a.eaf", 10.0)
    assert spans_of(read(tmp_path / "a.eaf", tier="hands")) == [(0.0, 1.0, "left")]
    with pytest.raises(
        UserError, match=r"has no tier 'hand'; its tiers are default, speech, hands; did you mean 'hands'\?"
    ):
        read(tmp_path / "a.eaf", tier="hand")
    document.rename_tier("hands", "gesture")
    document.to_file(tmp_path / "b.eaf")
    assert spans_of(read(tmp_path / "b.eaf", 10.0)) == [(0.0, 1.0, "left")]
    document.remove_tiers(["speech", "gesture"])
    document.to_file(tmp_path / "c.eaf")
    empty = read(tmp_path / "c.eaf", 10.0)
    tables.validate(empty, "annotations", "c")
    assert len(empty) == 0


def test_unlabelled_spans_are_not_examples(tmp_path):
    spans = [(0.0, 1.0, ""), (1.0, 2.0, " rest "), (2.0, 3.0, "  ")]
    assert spans_of(read(write(tmp_path / "a.csv", spans), 10.0)) == [(1.0, 2.0, "rest")]


@pytest.mark.parametrize("content", [b"", b"<ANNOTATION_DOCUMENT", b"<x/>", b"\x00\x01", b"File type = nonsense"])
@pytest.mark.parametrize("name", ["bad.eaf", "bad.TextGrid", "bad.txt"])
def test_damaged_and_foreign_files_are_rejected(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UserError, match=name) as caught:
        read(tmp_path / name, 10.0)
    assert len(str(caught.value).splitlines()) == 1
    with pytest.raises(UserError, match="none"):
        read(tmp_path / f"none_{name}", 10.0)


def eaf(path, body, media="", slots=(1000, 3000, 5000, 7000, None, None), units="milliseconds"):
    """Write an EAF file with time slots ts1, ts2, ...; None is a slot without a time."""
    times = ["" if value is None else f' TIME_VALUE="{value}"' for value in slots]
    order = "".join(f'<TIME_SLOT TIME_SLOT_ID="ts{number}"{time}/>' for number, time in enumerate(times, start=1))
    path.write_text(
        f'<?xml version="1.0" encoding="UTF-8"?><ANNOTATION_DOCUMENT><HEADER TIME_UNITS="{units}">{media}</HEADER>'
        f"<TIME_ORDER>{order}</TIME_ORDER>{body}</ANNOTATION_DOCUMENT>",
        encoding="utf-8",
    )
    return path


def eaf_tier(name, annotations, parent=None):
    """Return a tier of annotations (id, label, first slot, last slot) or (id, label, id referred to)."""
    inner = []
    for name_, label, *references in annotations:
        if len(references) == 2:
            kind, attributes = "ALIGNABLE", f'TIME_SLOT_REF1="{references[0]}" TIME_SLOT_REF2="{references[1]}"'
        else:
            kind, attributes = "REF", f'ANNOTATION_REF="{references[0]}"'
            if inner and references[0] in inner[-1]:
                attributes += f' PREVIOUS_ANNOTATION="{annotations[len(inner) - 1][0]}"'
        inner.append(
            f'<ANNOTATION><{kind}_ANNOTATION ANNOTATION_ID="{name_}" {attributes}>'
            f"<ANNOTATION_VALUE>{label}</ANNOTATION_VALUE></{kind}_ANNOTATION></ANNOTATION>"
        )
    of = f' PARENT_REF="{parent}"' if parent else ""
    return f'<TIER TIER_ID="{name}"{of}>{"".join(inner)}</TIER>'


GESTURE = eaf_tier("gesture", [("a1", "left", "ts1", "ts2"), ("a2", "rest", "ts3", "ts4")])


def test_a_tier_without_a_name_is_read_if_it_is_the_only_one(tmp_path):
    path = eaf(tmp_path / "a.eaf", GESTURE.replace(' TIER_ID="gesture"', ""))
    assert spans_of(read(path, 10.0)) == [(1.0, 3.0, "left"), (5.0, 7.0, "rest")]


def media(name, origin_ms=None, mime_type="audio/x-wav"):
    origin = "" if origin_ms is None else f' TIME_ORIGIN="{origin_ms}"'
    return f'<MEDIA_DESCRIPTOR MEDIA_URL="file:///C:/my%20films/{name}" MIME_TYPE="{mime_type}"{origin}/>'


@pytest.mark.parametrize(
    ("linked", "sound", "moved_s", "why"),
    [
        (media("a.wav", 5000), None, 5.0, "TIME_ORIGIN of a.wav in a.eaf"),
        (media("a.wav", 5000), "other/b.wav", 5.0, "TIME_ORIGIN of a.wav"),
        (media("a.mp4", 0, "video/mp4") + media("a.wav", 250), None, 0.25, "not 0.000 s for a.mp4"),
        (media("b.wav", 0) + media("a.wav", 250), "sounds/a.wav", 0.25, "not 0.000 s for b.wav"),
        (media("a.mp4", 40, "video/mp4"), "a.wav", 0.04, "TIME_ORIGIN of a.mp4"),
        (media("a.mp4", 40, "video/mp4") + media("a.wav"), "a.wav", 0.0, None),
        (media("a.wav", -500), None, -0.5, "moved by -0.500 s"),
    ],
)
def test_the_offset_of_the_sound_in_elan_moves_the_annotations(tmp_path, linked, sound, moved_s, why):
    table = read(eaf(tmp_path / "a.eaf", GESTURE, linked), 12.0, sound=sound)
    tables.validate(table, "annotations", "a")
    times = np.array([[1.0, 3.0], [5.0, 7.0]]) + moved_s
    np.testing.assert_allclose(table[["start_s", "end_s"]], times)
    assert ("note" in table) == (why is not None)
    assert why is None or why in table["note"].iloc[0]


@pytest.mark.parametrize(
    ("linked", "recording", "message"),
    [
        (media("a.wav", 0) + media("b.wav", 40), {"sound": "c.wav"}, "0.000 s for a.wav and 0.040 s for b.wav"),
        (media("a.wav", "5 s"), {}, "TIME_ORIGIN of a.wav is '5 s', not a whole number of milliseconds"),
        (media("a.wav", 5000), {"start_s": 7.0}, "begin at 5.000 s of the sound .* record begins at 7.000 s"),
        (media("a.wav", 9000), {}, "annotation a2: 'rest' at 14.000-16.000 s: extends past the end"),
    ],
)
def test_offsets_in_elan_that_fit_no_sound_are_rejected(tmp_path, linked, recording, message):
    with pytest.raises(UserError, match=message):
        read(eaf(tmp_path / "a.eaf", GESTURE, linked), 12.0, **recording)


def test_an_offset_that_is_the_start_of_the_excerpt_moves_nothing(tmp_path):
    table = read(eaf(tmp_path / "a.eaf", GESTURE, media("a.wav", 5000)), 12.0, start_s=5.0)
    assert spans_of(table) == [(1.0, 3.0, "left"), (5.0, 7.0, "rest")]


@pytest.mark.parametrize(
    "other",
    [
        eaf_tier("words", [("b1", "so", "ts1", "ts5"), ("b2", "then", "ts5", "ts2")], "gesture"),
        eaf_tier("words", [("b1", "so", "ts1", "ts5"), ("b2", "then", "nowhere", "ts2")]),
        eaf_tier("words", [("b1", "so", "ts2", "ts1"), ("b2", "then", "ts1", "ts2")]),
        eaf_tier("words", [("b1", "so", "missing")], "gesture") + "<TIER/><TIER TIER_ID='x'><ANNOTATION/></TIER>",
    ],
)
def test_faults_in_other_tiers_of_an_elan_file_do_not_matter(tmp_path, other):
    assert spans_of(read(eaf(tmp_path / "a.eaf", other + GESTURE))) == [(1.0, 3.0, "left"), (5.0, 7.0, "rest")]


@pytest.mark.parametrize("shared", [True, False], ids=["shared slots", "two slots per boundary"])
def test_boundaries_without_a_time_are_placed_evenly(tmp_path, shared):
    """As ELAN shows the annotations of a Time_Subdivision tier, whose boundaries nobody has moved."""
    labels, step = ["left", "rest", "open"], 1 if shared else 2
    n = len(labels)
    slots = [1000, *[None] * ((n - 1) * step), 4000]
    ends = [f"ts{2 + step * k}" for k in range(n - 1)] + [f"ts{len(slots)}"]
    starts = ["ts1"] + [f"ts{2 + step * k + step - 1}" for k in range(n - 1)]
    parts = [(f"b{k}", labels[k], starts[k], ends[k]) for k in range(n)]
    body = eaf_tier("phrase", [("a1", "x", "ts1", f"ts{len(slots)}")]) + eaf_tier("gesture", parts, "phrase")
    table = read(eaf(tmp_path / "a.eaf", body, slots=slots))
    edges = np.linspace(1, 4, n + 1)
    np.testing.assert_allclose(table[["start_s", "end_s"]], np.column_stack([edges[:-1], edges[1:]]))
    assert table["gesture"].tolist() == labels
    assert "placed evenly" in table["note"].iloc[0]


def test_boundaries_without_a_time_in_a_tier_of_a_tier(tmp_path):
    body = (
        eaf_tier("phrase", [("a1", "x", "ts1", "ts4")])
        + eaf_tier("half", [("b1", "x", "ts1", "ts5"), ("b2", "x", "ts5", "ts4")], "phrase")
        + eaf_tier("gesture", [("c1", "left", "ts5", "ts6"), ("c2", "open", "ts6", "ts4")], "half")
    )
    assert spans_of(read(eaf(tmp_path / "a.eaf", body))) == [(4.0, 5.5, "left"), (5.5, 7.0, "open")]


def test_a_tier_that_is_its_own_parent_ends_in_one_line(tmp_path):
    body = eaf_tier("gesture", [("a1", "left", "ts1", "ts5")], "gesture")
    with pytest.raises(UserError, match="has no end time"):
        read(eaf(tmp_path / "a.eaf", body))


def test_tiers_of_one_name_that_an_annotation_refers_to_are_told_apart(tmp_path):
    body = (
        eaf_tier("phrase", [("a1", "x", "ts1", "ts2")])
        + eaf_tier("class", [("b1", "x", "a1")])
        + eaf_tier("class", [("c1", "x", "a1"), ("c2", "x", "a1")])
        + eaf_tier("gesture", [("d1", "left", "b1"), ("d2", "rest", "c2")])
    )
    with pytest.raises(UserError, match=r"'rest' at 2\.000-3\.000 s: overlaps 'left' at 1\.000-3\.000 s"):
        read(eaf(tmp_path / "a.eaf", body))


def test_annotations_that_refer_to_others_have_their_times(tmp_path):
    phrases = eaf_tier("phrase", [("a1", "x", "ts1", "ts2"), ("a2", "y", "ts3", "ts4")])
    one_each = eaf_tier("gesture", [("b1", "left", "a1"), ("b2", "rest", "a2")], "phrase")
    assert spans_of(read(eaf(tmp_path / "a.eaf", phrases + one_each))) == [(1.0, 3.0, "left"), (5.0, 7.0, "rest")]
    parts = eaf_tier("gesture", [("b1", "left", "a1"), ("b2", "rest", "a1")], "phrase")
    assert spans_of(read(eaf(tmp_path / "b.eaf", phrases + parts))) == [(1.0, 2.0, "left"), (2.0, 3.0, "rest")]


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ([("a1", "left", "ts1", "ts5")], r"tier 'gesture', annotation a1 \('left'\): has no end time"),
        ([("a1", "left", "ts5", "ts1")], r"annotation a1 \('left'\): has no start time"),
        ([("a1", "left", "ts1", "ts9")], "tier 'gesture' refers to time slot 'ts9', which does not exist"),
        ([("a1", "left", "ts1", "ts6")], "time slot 'ts6' of tier 'gesture' has the time '2,5'"),
        ([("a1", "left", "b1")], "annotation a1 .* refers to annotation 'b1', which does not exist"),
        ([("a1", "left", "a1")], "annotation a1 .*refers to itself"),
        ([("a1", "left", "ts2", "ts1")], "annotation a1: 'left' at 3.000-1.000 s"),
    ],
)
def test_annotations_without_times_are_named(tmp_path, body, message):
    path = eaf(tmp_path / "bad.eaf", eaf_tier("gesture", body), slots=(1000, 3000, 5000, 7000, None, "2,5"))
    with pytest.raises(UserError, match=message) as caught:
        read(path)
    assert "damaged" not in str(caught.value)


def test_elan_files_that_count_frames_and_twins_among_tiers_are_rejected(tmp_path):
    with pytest.raises(UserError, match="counts time in PAL-frames"):
        read(eaf(tmp_path / "a.eaf", GESTURE, units="PAL-frames"))
    with pytest.raises(UserError, match="two tiers called 'gesture'"):
        read(eaf(tmp_path / "a.eaf", GESTURE + GESTURE))


def grid(path, *tiers, start=0, end=10, encoding="utf-8", short=False):
    """Write a TextGrid of tiers (name, [(start, end, label)]) or (name, [(time, label)])."""
    fields = [
        ("File type = ", '"ooTextFile"'),
        ("Object class = ", '"TextGrid"'),
        ("xmin = ", start),
        ("xmax = ", end),
    ]
    fields += [("tiers? ", "<exists>"), ("size = ", len(tiers))]
    for number, (name, rows) in enumerate(tiers, start=1):
        kind = "IntervalTier" if len(rows[0]) == 3 else "TextTier"
        fields += [(f"item [{number}]: class = ", f'"{kind}"'), ("name = ", f'"{name}"')]
        fields += [("xmin = ", start), ("xmax = ", end), ("intervals: size = ", len(rows))]
        for index, (*times, label) in enumerate(rows, start=1):
            fields += [*((f"intervals [{index}]: time = ", f"{time} ") for time in times), ("text = ", f'"{label}"')]
    path.write_text("\n".join(f"{'' if short else name}{value}" for name, value in fields), encoding=encoding)
    return path


@pytest.mark.parametrize("short", [False, True])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-be", "latin-1"])
def test_a_textgrid_is_read_in_every_encoding_and_format(tmp_path, encoding, short):
    words = ("ölçü", [(0, 2.5, 'he said ""so"" at 12'), (2.5, "1e1", "! no comment\n7 [1] = 3 <exists>")])
    points = ("clicks", [(2.0, "click")])
    path = grid(
        tmp_path / "a.TextGrid", words, points, ("gesture", [(0, "1e-05", ""), ("1e-05", 3, "left"), (3, 10, "")]),
        encoding=encoding, short=short,
    )  # fmt: skip
    assert spans_of(read(path)) == [(1e-05, 3.0, "left")]


def test_overlaps_by_rounding_do_not_matter_in_any_tier(tmp_path):
    words = ("words", [(0, 3.0000001, "a"), (3, 2, "b"), (2, 10, "")])
    hands = ("gesture", [(-1e-7, 1.0000001, "left"), (1, 4, "rest"), (4, 10.0000001, "open")])
    table = read(grid(tmp_path / "a.TextGrid", words, hands))
    assert spans_of(table) == [(0.0, 1.0000001, "left"), (1.0000001, 4.0, "rest"), (4.0, 10.0, "open")]


def test_a_textgrid_that_keeps_the_times_of_a_longer_one_is_moved(tmp_path):
    path = grid(tmp_path / "a.TextGrid", ("gesture", [(13, 15, "left"), (17, 19, "rest")]), start=12, end=22)
    table = read(path, tolerance_s=1.0)
    assert spans_of(table) == [(1.0, 3.0, "left"), (5.0, 7.0, "rest")]
    assert table["note"].iloc[0] == "annotations moved by -12.000 s (a.TextGrid starts at 12.000 s)"
    assert spans_of(read(path, 9.5, tolerance_s=1.0)) == spans_of(table)
    with pytest.raises(UserError, match=r"runs from 12.000 to 22.000 s and the record from 0 to 24.000 s"):
        read(path, 24.0, tolerance_s=1.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace('"IntervalTier"', '"TextTier"'), "is missing"),
        (lambda text: text.replace('"TextGrid"', '"Collection"'), "a Praat object of class Collection"),
        (
            lambda text: text.replace("time = 3 ", "time = three ", 1),
            "the end of interval 1 of tier 'gesture' is missing",
        ),
        (lambda text: text[: text.index("intervals [2]")], "the time of interval 2 of tier 'gesture' is missing"),
        (lambda text: "ooBinaryFile\x08TextGrid\x00\x00", "is a binary file of Praat"),
        (lambda text: '"Praat chronological TextGrid text file"\n0 10', "chronological TextGrid"),
        (lambda text: text.replace("size = 1", "size = 1e999"), "the number of tiers is missing"),
    ],
)
def test_textgrids_that_cannot_be_read_are_rejected_with_the_place(tmp_path, change, message):
    path = grid(tmp_path / "bad.TextGrid", ("gesture", [(0, 3, "left"), (3, 10, "")]))
    path.write_text(change(path.read_text()))
    with pytest.raises(UserError, match=message) as caught:
        read(path)
    assert "damaged" not in str(caught.value)


def test_a_point_tier_has_no_gestures(tmp_path):
    path = grid(tmp_path / "a.TextGrid", ("gesture", [(1, "left")]), ("words", [(0, 10, "so")]))
    with pytest.raises(UserError, match="tier 'gesture' has points, not intervals"):
        read(path)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "latin-1"])
@pytest.mark.parametrize(
    "text",
    [
        "start_s;end_s;gesture\r\n1,5;3;left\r\n;;\r\n00:00:05;0:07,25;rest\r\n",
        "start_s\tend_s\tgesture\tübrig\r1.5\t3\tleft\r5\t7.25\trest",
        'sep=;\nstart_s;end_s;gesture;\n1,5;3;"left";\n5;7,25;rest;;\n',
        ' start_s , end_s ,gesture\n"1,5","3",left\n\n5, 7.25 , rest \n'.replace("7.25", '"7,25"').replace(
            ', "', ',"'
        ),
        "tier,start_s,end_s,gesture\nwords,0,9,so\ngesture,1.5,3,left\ngesture,5,7.25,rest\n",
    ],
)
def test_csv_files_of_spreadsheets_are_read(tmp_path, text, encoding):
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    assert spans_of(read(tmp_path / "a.csv")) == [(1.5, 3.0, "left"), (5.0, 7.25, "rest")]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("start_s;end;gesture\n", r"column 'end_s' is missing \(columns are separated by semicolons\)"),
        (
            "start_s,end_s,gesture\n1,5,3,left\n",
            "line 2 has more cells .*decimal commas.*separate the columns by ';'",
        ),
        ("start_s;end_s;gesture\n1,5;3;left\n3;1.250;rest\n", "'1,5' in line 2 .*'1.250' in line 3 a decimal point"),
        ('start_s,end_s,gesture\n1,"1,500",rest\n', "may be a decimal comma or separate thousands"),
        ("start_s,end_s,gesture\n1,00:00:05:12,rest\n", "a time code with a frame number"),
        ('start_s,end_s,gesture\n\n1,2,"re\nst"\n1,2,', "line 3: the cell in column 'gesture' contains a line break"),
        ('start_s,end_s,gesture\n1,2,rest\n2,3,"left\n3,4,rest\n', "line 3: the cell in column 'gesture'"),
        ("start_s,end_s,end_s\n", "two columns are called 'end_s'"),
        ("start_s,,gesture\n", "column 2 has no name"),
        ("start_s,end_s,gesture\n1,2,left\n2,1,rest\n", "line 3: 'rest' at 2.000-1.000 s"),
    ],
)
def test_csv_files_that_cannot_be_read_are_rejected_with_the_line(tmp_path, text, message):
    (tmp_path / "bad.csv").write_text(text, newline="")
    with pytest.raises(UserError, match=message):
        read(tmp_path / "bad.csv")


def test_notes_on_annotations_are_added_to_those_on_records():
    records = pd.DataFrame({"record": ["a", "b", "c"], "note": ["mixed down", None, None]})
    table = annotations.table("a", SPANS, 10.0, "person")
    assert annotations.add_notes(records, table) is records
    noted = pd.concat([table, table.assign(record="b", note="moved"), table.assign(record="a", note="x")])
    assert annotations.add_notes(records, noted)["note"].tolist() == ["mixed down; x", "moved", None]


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
        table = read(path, 10.0)
    except UserError:
        return
    tables.validate(table, "annotations", name)
    assert (table["end_s"] > table["start_s"]).all()
    assert (table["start_s"].to_numpy()[1:] >= table["end_s"].to_numpy()[:-1] - 1e-9).all()
    assert set(table["gesture"]) <= set(LABELS)


def test_a_textgrid_of_a_longer_recording_is_refused(tmp_path):
    path = write(tmp_path / "a.TextGrid", [(1, 3, "left")], 30.0)
    with pytest.raises(UserError, match=r"a\.TextGrid: the TextGrid runs from 0.000 to 30.000 s and the record"):
        read(path, 10.0)
    assert spans_of(read(path, 29.5, tolerance_s=1.0)) == [(1.0, 3.0, "left")]

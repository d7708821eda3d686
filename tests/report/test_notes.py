"""Notes of records: all of them on the page, readable for few and for many records."""

import pandas as pd
import pytest

from cospeech.report.page import notes, provenance


def table(**of_record):
    return pd.DataFrame({"record": list(of_record), "note": list(of_record.values())})


def test_equal_notes_are_grouped_and_each_of_a_record_stands_alone():
    found = notes.grouped(table(a="mixed down; voice trimmed by 0.5 s", b=None, c="mixed down"))
    assert found == [("mixed down", ["a", "c"], False), ("voice trimmed by 0.5 s", ["a"], False)]


def test_notes_of_few_records_are_shown_as_they_are():
    found = notes.grouped(table(a="faces 73 degrees", b="faces 9.5 degrees; clipped", c="faces 73 degrees"))
    assert found == [
        ("faces 73 degrees", ["a", "c"], False),
        ("faces 9.5 degrees", ["b"], False),
        ("clipped", ["b"], False),
    ]


def test_notes_of_many_records_that_differ_in_numbers_only_are_one_note_with_their_range():
    many = {f"r{k}": f"faces {9.5 + k} degrees, at 48000 Hz" for k in range(13)}
    found = notes.grouped(table(**many, c="joint spine2"))
    assert found[0] == ("faces 9.5 to 21.5 degrees, at 48000 Hz", list(many), False)
    assert found[1].text == "joint spine2"  # the number of a name is not a value


def test_braces_and_repeated_notes_are_harmless():
    found = notes.grouped(table(a="as {record} 1 {}; as {record} 1 {}", b="as {record} 1 {}"))
    assert found == [("as {record} 1 {}", ["a", "b"], True)]


def test_five_hundred_records_take_a_few_lines():
    many = {f"r{k}": f"voice trimmed by 0.{k:03d} s; " + ("clipped" if k % 2 else "mixed down") for k in range(500)}
    found = notes.grouped(table(**many))
    assert [(note.text, len(note.records), note.all, note.folded) for note in found] == [
        ("voice trimmed by 0.000 to 0.499 s", 500, True, False),
        ("mixed down", 250, False, True),
        ("clipped", 250, False, True),
    ]


def test_nothing_is_said_where_nothing_was_adjusted():
    assert notes.grouped(table(a=None, b=None)) == []


CONFIG = {
    "corpus": {"source": "recorded", "name": "mine"},
    "phrases": {"gesture": {"first_examples": "annotations", "labels": ["rest", "left"]}},
}
RULES = CONFIG | {"phrases": {"gesture": {"first_examples": "rules", "labels": ["rest", "left"]}}}
RECORDS = pd.DataFrame({"record": ["a", "b"], "actor": "x", "duration_s": 60.0, "motion_source": "bvh"})
DELIVERED = RECORDS.assign(motion_source=None)
MIXED = RECORDS.assign(motion_source=["bvh", None])
NOBODY = pd.DataFrame({"record": [], "gesture": [], "origin": []})
PERSON = pd.DataFrame({"record": "a", "gesture": ["rest", "left"], "origin": "person"})


def said(config, records, annotations):
    return " ".join(provenance.banner(config, records, annotations).lines)


@pytest.mark.parametrize(
    ("config", "records", "annotations", "says", "silent"),
    [
        (CONFIG, RECORDS, PERSON, "from examples: 2 labelled by a person. The actual phrases, with which scores "
         "compare, were found by a program", ("rules", "delivered")),
        (RULES, RECORDS, NOBODY, "from examples that rules proposed from the joint angles.", ("delivered",)),
        (RULES, RECORDS, PERSON, "2 labelled by a person.", ("rules",)),
        (RULES, RECORDS, PERSON[:1], "1 labelled by a person. Where an actor had none of a class, rules", ()),
        (CONFIG, DELIVERED, NOBODY, "The actual phrases, with which scores compare, were delivered",
         ("program", "learned")),
        (CONFIG, MIXED, PERSON, "The actual phrases of b, with which scores compare, were delivered", ()),
        (CONFIG, MIXED, PERSON, "The other actual phrases, with which scores compare, were found by a program", ()),
    ],
)  # fmt: skip
def test_where_the_actual_phrases_come_from(config, records, annotations, says, silent):
    text = said(config, records, annotations)
    assert says in text
    assert not any(word in text for word in silent)


@pytest.mark.parametrize(
    ("settings", "says", "silent"),
    [
        ({}, "speech predicts gesture in 80 % of the phrases (coupling 0.8).", "there is no voice"),
        ({"sound": False}, "there is neither voice nor body. By design, speech predicts gesture", "a body moved"),
        ({"world": "vigour", "sound": False, "motion": True}, "a body moved; there is no voice. By design, speech "
         "tells how vigorously the hands move in 80 % of the time (coupling 0.8).", "predicts"),
        ({"coupling": 0}, "speech does not predict gesture, so that no system should beat its controls", "80 %"),
        ({"world": "all", "coupling": 0, "couplings": {"vigour": 0.5}}, "(coupling 0; vigour: 0.5)", "does not"),
        ({"actors": [{"actor": "ada"}, {"actor": "eda"}, {"actor": "deniz", "world": "vigour", "coupling": 0.5}]},
         "By design, what speech tells differs between the actors: that of ada and eda predicts gesture in 80 % of "
         "the phrases (coupling 0.8); that of deniz tells how vigorously the hands move in 50 % of the time "
         "(coupling 0.5).", "of all"),
    ],
)  # fmt: skip
def test_what_was_planted_is_said_of_every_world(settings, says, silent):
    studio = {
        "world": "phrases",
        "sound": True,
        "motion": False,
        "coupling": 0.8,
        "couplings": {},
        "head_coupling": None,
    }
    studio |= {"actors": [{"actor": "ada"}]} | settings
    text = said(CONFIG | {"corpus": {"source": "studio"}, "studio": studio}, RECORDS, NOBODY)
    assert says in text
    assert silent not in text

"""What a system can declare, what it cannot, and the controls that follow from it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cospeech.synthesis.declaration import DRAWS, RESERVED, DeclarationError, System


def declare(**changed):
    return System(**{"name": "controller", "title": "Gesture controller", "method": "elsewhere.controller"} | changed)


def test_a_new_system_brings_its_controls():
    system = declare(order=40, settings={"depth": 3}, tables={"states": "states"}, schemas="elsewhere")
    controls = system.matched_controls()
    assert [control.name for control in controls] == ["controller_shuffled", "controller_shifted"]
    assert system.controls == ("controller_shuffled", "controller_shifted")
    assert [control.drive for control in controls] == ["shuffled", "shifted"]
    assert {control.decoder for control in controls} == {"controller"}
    assert {control.role for control in controls} == {"control"}
    assert all(control.controls == () and control.matched_controls() == [] for control in controls)
    for control in controls:
        assert control.title.startswith("Gesture controller: ")
        for same in ("method", "needs", "makes", "tables", "schemas", "settings", "model"):
            assert getattr(control, same) == getattr(system, same)


def test_controls_can_have_names_of_their_own():
    names = [control.name for control in declare(controls=("scrambled", "moved")).matched_controls()]
    assert names == ["scrambled", "moved"]


@pytest.mark.parametrize("role", ["control", "ceiling"])
def test_controls_and_ceilings_have_no_matched_controls(role):
    assert declare(role=role, needs=("gestures",)).matched_controls() == []


def test_a_model_is_a_systems_own_or_shared():
    assert declare().model == "controller"
    assert declare(shares="hsmm").model == "hsmm"
    assert declare(shares="hsmm").decoder == "controller"


def test_schemas_of_a_package_are_named_after_it():
    assert declare(tables={"states": "hmm"}).table_schemas == {"states": "hmm"}
    assert declare(tables={"states": "hmm"}, schemas="a.b").table_schemas == {"states": "a.b:hmm"}


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"name": "two words"}, "declares the name 'two words'; use letters"),
        ({"name": ""}, "declares the name ''"),
        ({"name": "../up"}, "declares the name '../up'"),
        ({"name": "original"}, "declares the name 'original', which stands for the actor's own motion"),
        ({"title": 3}, "declares title 3; expected str"),
        ({"role": "oracle"}, "declares role 'oracle'; known are system, control, ceiling"),
        ({"makes": "speech"}, "declares makes 'speech'; known are phrases, motion"),
        ({"drive": "backwards"}, "declares drive 'backwards'; known are own, shuffled, shifted"),
        ({"needs": "prosody"}, "declares needs 'prosody'; expected tuple"),
        ({"needs": ("prosody", "smell")}, "declares that it needs 'smell'; known are gestures, prosody_labels"),
        (
            {"needs": ("gestures", "motion")},
            "role 'system', but needs none of 'prosody_labels', 'prosody'",
        ),
        ({"tables": ["states"]}, r"declares tables \['states'\]; expected mapping"),
        ({"tables": {"phrases": "segments"}}, "declares a table 'phrases' of its model; the name is reserved"),
        ({"reports": {"motion": "segments"}}, "declares a table 'motion' among its reports; the name is reserved"),
        (
            {"reports": {"a": "a"}, "tables": {"a": "a"}},
            "declares a table 'a' both of its model and among its reports",
        ),
        ({"tables": {"states": "../hmm"}}, "declares the table 'states' with the schema '../hmm'"),
        ({"tables": {"states": None}}, "declares the table 'states' with the schema None"),
        ({"settings": 5}, "declares settings 5; expected mapping"),
        ({"order": "first"}, "declares order 'first'; expected int"),
        ({"method": ""}, "declares no method"),
        ({"method": None}, "declares method None; expected str"),
        (
            {"controls": ("one",)},
            r"declares the controls \('one',\); give two names, for shuffled and shifted speech",
        ),
        ({"controls": ("one", "t w o")}, "give two names"),
    ],
)
def test_an_impossible_declaration_is_refused(changed, message):
    with pytest.raises(DeclarationError, match=message):
        declare(**changed)


@given(st.text(max_size=12))
def test_a_name_is_a_name_in_paths(name):
    try:
        system = declare(name=name)
    except DeclarationError:
        return
    assert name
    assert not set(name) & set("/\\. \n\t~,=")
    assert system.name == name


@pytest.mark.parametrize("table", RESERVED)
def test_tables_next_to_a_model_keep_their_names(table):
    with pytest.raises(DeclarationError, match=table):
        declare(tables={table: "segments"})


def test_controls_that_depend_on_chance_are_drawn_repeatedly():
    system = declare()
    assert [control.draws for control in system.matched_controls()] == [DRAWS] * 2
    mover = declare(makes="motion")
    assert [control.draws for control in mover.matched_controls()] == [DRAWS] * 2
    with pytest.raises(DeclarationError, match="declares 3 draws; only a control"):
        declare(draws=3)

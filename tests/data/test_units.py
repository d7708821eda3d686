"""A unit is a name or its length in metres."""

import pytest

from cospeech.data import units


@pytest.mark.parametrize(
    ("unit", "metres"),
    [("m", 1), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254), ("inch", 0.0254), (0.056444, 0.056444)],
)
def test_units_in_metres(unit, metres):
    assert units.metres_per_unit(unit) == metres


def test_a_unit_that_contradicts_the_file_is_noted():
    assert units.replaced("mm", 0.001) == []
    assert units.replaced("MM", "mm") == []
    assert units.replaced("mm", "m") == ["unit 'mm' of the file replaced by the declared m"]
    assert units.replaced("", 0.056444) == ["unit '' of the file replaced by the declared 0.056444 m"]


@pytest.mark.parametrize(
    ("written", "metres"), [("MM", 0.001), ("Meters", 1), ("centimetres", 0.01), ("inches", 0.0254)]
)
def test_files_may_spell_units_out(written, metres):
    assert units.stated_metres(written) == metres
    assert units.stated_metres("furlongs") is None

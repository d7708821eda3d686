"""What the equations give as printed and as read: exact where nothing is measured, and as the trials found."""

import numpy as np
import pytest

from cospeech.capture.head import readings
from cospeech.geometry import rotation


@pytest.fixture(scope="module")
def found():
    return {reading.quantity: reading for reading in readings.readings(2012)}


def test_the_printed_translation_is_off_by_the_chord_of_the_turn(found):
    own = found["error of the place after a turn of 10°"]
    assert own.as_printed == pytest.approx(1000 * 2 * np.sin(np.radians(5.0)), rel=0.05)  # 174 mm at 1 m
    assert own.as_read < 1e-9


def test_newton_as_printed_is_slower_and_finds_more(found):
    steps, large = found["Newton steps for a rotation of 30°"], found["rotations of 130° that are found"]
    assert steps.as_printed > 2 * steps.as_read
    assert (large.as_printed, large.as_read) == (100.0, pytest.approx(0.0, abs=60.0))


def test_one_argument_of_the_arctangent_loses_half_a_turn(found):
    own = found["largest error of the nod within ±120°"]
    assert own.as_printed == pytest.approx(180.0)
    assert own.as_read < 1e-9


def test_added_increments_drift_and_composed_ones_return(found):
    own = next(own for reading, own in found.items() if reading.startswith("largest error in 4 s"))
    assert own.as_printed > 30.0
    assert own.as_read < 1e-9
    turned = rotation.from_euler("XYZ", readings.movement())
    assert rotation.angles_deg(turned).max() > 40.0


def test_the_smoother_leaves_less_noise_than_the_filter(found):
    own = found["error left of 0.2° of noise"]
    assert own.as_read < 0.7 * own.as_printed

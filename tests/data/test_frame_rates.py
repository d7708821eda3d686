"""A rounded frame time is that of the common rate that it was rounded from, unless several fit."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cospeech.data import frame_rates
from cospeech.errors import UserError

# frame times as programs write them: rounded or truncated to few decimals
ROUNDED = {
    "0.017": 60, "0.0167": 60, "0.01667": 60, "0.0166": 60, "0.0170000": 60, "1.7e-2": 60, "0.033": 30, "0.0333": 30,
    "0.03": 30, "0.0083": 120, "0.00833": 120, "0.042": 24, "0.0417": 24, "0.0416": 24, "0.041": 24, "0.0334": 29.97,
    "0.0111": 90, "0.011": 90, "0.0069": 144, "0.0042": 240, "0.067": 15, "0.021": 48,
}  # fmt: skip
EXACT = {
    "0.05": 20, "0.04": 25, "0.02": 50, "0.01": 100, "0.1": 10, "0.005": 200, "0.033333": 30, "0.0333333": 30,
    "0.016667": 60, "0.0166667": 60, "0.008333": 120, "0.0333667": 29.97, "0.041708": 23.976, "0.0080000": 125,
    "0.0040000": 250, "0.0160000": 62.5, "0.027027": 37, "1.0": 1, "0.2": 5,
}  # fmt: skip


@pytest.mark.parametrize("written", ROUNDED)
def test_coarse_frame_times_become_common_rates_with_a_note(written):
    fps, notes = frame_rates.from_frame_time(f" {written}\n", "a.bvh")
    assert fps == ROUNDED[written]
    assert len(notes) == 1
    assert f"{written} s" in notes[0]
    assert f"{fps:g} frames/s" in notes[0]


@pytest.mark.parametrize("written", EXACT)
def test_exact_frame_times_are_taken_as_they_are(written):
    assert frame_rates.from_frame_time(written, "a.bvh") == (EXACT[written], [])


def test_the_note_names_the_rate_of_television_that_fits_as_well():
    assert frame_rates.from_frame_time("0.017", "a")[1][0].endswith("taken as 60 frames/s; 59.94 fits as well")


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("0.008", "120 and 125 frames/s fit"),
        ("0.004", "240 and 250 frames/s fit"),
        ("0.007", "144 and 150 frames/s fit"),
        ("0.016", "60 and 62.5 frames/s fit a frame time of 0.016 s; write it with 7 decimals"),
        ("33", "write seconds per frame"),
        ("0", "write seconds per frame"),
        ("-0.05", "write seconds per frame"),
        ("nan", "write seconds per frame"),
        ("1e-999999", "write seconds per frame"),
        ("fast", "'fast' is not a number"),
        ("sNaN", "is not a number"),
    ],
)
def test_other_frame_times_are_rejected(written, message):
    with pytest.raises(UserError, match=r"^a\.bvh: .*" + message):
        frame_rates.from_frame_time(written, "a.bvh")


def test_a_coarse_frame_time_of_no_common_rate_is_noted():
    fps, notes = frame_rates.from_frame_time("0.029", "a.bvh")
    assert fps == pytest.approx(1 / 0.029)
    assert notes == ["frame time 0.029 s has few digits: its frame rate may be off by 1.7 %"]


@given(st.sampled_from(frame_rates.COMMON), st.integers(5, 10))
def test_common_rates_survive_five_decimals(fps, decimals):
    found, _ = frame_rates.from_frame_time(f"{1 / fps:.{decimals}f}", "a.bvh")
    assert abs(found / fps - 1) < 1.1e-3  # with five decimals, 59.94 may be read as 60
    if decimals >= 7:
        assert found == fps


@pytest.mark.parametrize(
    ("written", "fps"),
    [(29.97, 29.97), (30000 / 1001, 29.97), (59.939998626708984, 59.94), (23.98, 23.976), (60.0, 60), (33.0, 33),
     (59.99, 60), (37.5, 37.5), (61.3, 61.3), (12.5, 12.5), (300.0, 300)],
)  # fmt: skip
def test_rates_keep_their_value_but_for_rounding(written, fps):
    assert frame_rates.from_rate(written) == (fps, [])


@pytest.mark.parametrize(("written", "fps"), [(29, 29.97), (59, 59.94), (119, 119.88), (23, 23.976)])
def test_rates_of_television_without_decimals_are_recognised_and_noted(written, fps):
    found, notes = frame_rates.from_rate(float(written))
    assert found == fps
    assert notes == [f"frame rate {written}, truncated in the file, taken as {fps} frames/s"]

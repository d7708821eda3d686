"""What exhibits and findings say about heads, on made-up scores."""

import dataclasses
import io

import numpy as np
import pandas as pd
import plausible
import plausible_heads
import pytest
from plausible import RUN

from cospeech.report.exhibits import head as heads
from cospeech.report.exhibits import head_curves, head_patterns, head_scores, transplant
from cospeech.report.page.head_findings import head_findings

RUN_OF_HEADS = dataclasses.replace(RUN, heads=plausible_heads.SYSTEMS, shown_heads=plausible_heads.SHOWN)
SESSIONS = plausible_heads.sessions(plausible.ACTORS)


def test_the_board_lists_each_system_above_its_controls():
    board = head_scores.table(RUN_OF_HEADS, head_scores.board(RUN_OF_HEADS, SESSIONS).numbers)
    assert [row.line.system for row in board.rows] == [
        "nods", "nods_shuffled", "nods_shifted", "baseline", "baseline_shuffled", "baseline_shifted", "still_head"
    ]  # fmt: skip
    assert board.heads == [
        "normalised distance",
        "Mahalanobis distance",
        "Euclidean distance (°)",
        "correlation of speeds",
    ]
    own = SESSIONS[(SESSIONS["system"] == "nods") & SESSIONS["other"].isna() & (SESSIONS["unit"] == "record")]
    mean = own.loc[own["measure"] == "euclidean", "value"].item()
    assert board.rows[0].cells[2].value == f"{mean:.2f}"


def test_published_distances_stand_next_to_those_of_the_first_two_systems():
    numbers = head_scores.board(RUN_OF_HEADS, SESSIONS).numbers
    pairs = head_scores.compare(RUN_OF_HEADS, numbers, RUN.published["head-table-4.1"])
    assert [pair.what for pair in pairs][::3] == [
        "normalised distance, Nodding head", "normalised distance, Baseline"
    ]  # fmt: skip
    assert len(pairs) == 6


def test_findings_say_what_the_intervals_allow():
    drawn = head_scores.differences(RUN_OF_HEADS, SESSIONS)
    first, second, last = head_findings(RUN_OF_HEADS, drawn.numbers, None)
    assert first.claim == "“Nodding head” moves with the voice."
    assert first.evidence[0].startswith("correlation of angular speeds, minus own speech, shifted: +0.")
    assert second.claim == "“Baseline” moves with the voice."
    assert last.claim == "“A head that does not move” is farther from the recorded head than “Nodding head”."
    swapped = drawn.numbers.assign(**{name: -drawn.numbers[name] for name in ("value", "low", "high")})
    swapped = swapped.rename(columns={"low": "high", "high": "low"})
    first, _, last = head_findings(RUN_OF_HEADS, swapped, None)
    assert first.claim == "“Nodding head” cannot be shown to move with the voice."
    assert last.claim == "“A head that does not move” is nearer to the recorded head than “Nodding head”."
    one = drawn.numbers.assign(n=2)
    [few] = head_findings(RUN_OF_HEADS, one, None)
    assert few.claim.startswith("2 records cannot distinguish")


def test_patterns_are_named_by_their_largest_angle():
    drawn = head_patterns.gestures(RUN, plausible_heads.patterns(["x_deg", "y_deg", "z_deg"], "g"))
    kinds = drawn.numbers.drop_duplicates("pattern").set_index("pattern")["kind"].to_dict()
    assert kinds == {"g1": "rest", "g2": "turn left", "g3": "tilt right", "g4": "head up", "g5": "turn right"}
    assert drawn.numbers["frames"].iloc[0] == pytest.approx(10.0)


def test_the_timeline_shows_where_the_head_moves_most():
    angles = np.zeros((3000, 3))
    angles[1500:1800, 1] = 20.0 * np.sin(np.arange(300) / 8.0)
    original = plausible_heads.head.table(angles, 30.0)
    drawn = heads.timeline(RUN_OF_HEADS, original, {"nods": original})
    assert drawn.numbers["time_s"].between(50.0, 60.0).sum() == 2 * 300
    assert set(drawn.numbers["system"]) == {"original", "nods"}


def test_errors_of_capture_are_means_and_maxima_over_records():
    numbers = heads.captured(RUN, plausible_heads.captured(plausible.ACTORS)).numbers
    turned = numbers[numbers["quantity"] == "rotation"].iloc[0]
    n_records = len(plausible.ACTORS)
    assert turned["mean"] == pytest.approx(0.3 + 0.05 * (n_records - 1) / 2)
    assert turned["largest"] == pytest.approx(1.5 + 0.1 * (n_records - 1))
    assert turned["tracked_pct"] == pytest.approx(100 * 880 / 900)
    table = heads.captured_table(RUN, numbers)
    assert table.rows[-1][1] == "1.7 %, 0.6 %"


def test_the_accuracy_of_capture_is_that_of_the_worst_axis():
    table = heads.accuracy_table(RUN, heads.accuracy(RUN, plausible_heads.accuracy()).numbers)
    assert len(table.rows) == 4
    assert table.rows[1][:5] == ["320 pixels", "1", "2", "stereo", "as printed"]
    assert table.rows[0][5:] == ["0.50", "1.50", "0 %"]


def test_each_criterion_chooses_its_best_number_of_patterns():
    own = head_curves.joints(RUN, plausible_heads.curves()).numbers
    assert set(own["stream"]) == {"joint"}
    [pair] = head_curves.compare(RUN, own, RUN.published["head-fig-4.10"])
    assert pair.published == "6 (by α and β together)"
    assert pair.ours == "α: 8, β: 2, BIC per frame: 5, stability over restarts: 2"


def test_transplanted_heads_stand_between_recorded_ones():
    drawn = transplant.heads(RUN_OF_HEADS, plausible_heads.transplant(plausible.ACTORS))
    rows = transplant.head_table(RUN_OF_HEADS, drawn.numbers).rows
    assert [row[1].split(", ")[1] for row in rows] == [
        "recorded with this voice", "own model", "transplant", "recorded"
    ]  # fmt: skip
    assert [row[-1] for row in rows] == ["", "", "0.70", ""]
    assert rows[3][0] == ""
    assert set(drawn.numbers["title"]) == {"Nodding head"}


def test_readings_have_their_units():
    stored = io.StringIO(heads.readings(RUN, plausible_heads.readings()).numbers.to_csv(index=False))
    rows = heads.readings_table(RUN, pd.read_csv(stored, dtype={"equation": str})).rows
    assert rows[0] == [
        "4.5",
        "Euler angles are added",
        "rotations are composed",
        "largest error",
        "50.00 °",
        "0.00 °",
    ]
    assert rows[1][4:] == ["900.00", "1.00"]


def test_every_stage_of_generation_is_drawn():
    drawn = head_curves.generation(RUN, plausible_heads.generation())
    assert len(drawn.figure.axes[0].lines) == 4 + 2  # four stages, and two changes of pattern
    assert set(drawn.numbers["stage"]) == {"drawn", "median", "printed", "kept"}


def test_planted_and_found_lags_stand_side_by_side():
    drawn = heads.recovered(RUN, plausible_heads.recovery(plausible.ACTORS))
    table = heads.recovery_table(RUN, pd.DataFrame(drawn.numbers))
    assert table.rows[0][1:] == ["0.80", "0.80 to 0.80"]
    assert table.rows[-1][1:] == ["0.20 s", "planted: 0.20 s"]

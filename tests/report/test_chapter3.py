"""The exhibits and findings of route directions, from made-up scores and from measured co-occurrence."""

import numpy as np
import pandas as pd
import plausible
import pytest

from cospeech.data import tables
from cospeech.evaluation import co_occurrence, directions
from cospeech.evaluation.co_occurrence import Settings
from cospeech.report import exhibits
from cospeech.report.exhibits import chapter3, declaration
from cospeech.report.page import directions as page
from cospeech.speech import accents

RUN = plausible.RUN


def detections(task, method, setting, labels, actual, portion="test"):
    number = len(labels)
    return pd.DataFrame(
        {"task": task, "method": method, "setting": setting, "portion": portion, "record": "a",
         "start_s": np.arange(number, dtype=float), "end_s": np.arange(number) + 0.5, "label": labels,
         "actual": actual}
    )  # fmt: skip


def scores():
    """Scores of 20 events of each kind, of which some are recognised."""
    rng = np.random.default_rng(1)
    kinds = {"word": ["left", "bank"] * 10, "head": ["nod", "tilt"] * 10}
    events = pd.concat(
        [
            pd.DataFrame({"record": record, "tier": tier, "start_s": np.arange(20.0), "end_s": np.arange(20) + 0.5,
                          "label": labels})
            for record in ("a", "b") for tier, labels in kinds.items()
        ]
    )  # fmt: skip
    records = pd.DataFrame({"record": ["a", "b"], "portion": ["test", "validation"]})
    found = [
        detections("keywords", "word HMMs", setting, ["left"] * wanted, None, portion).assign(record=record)
        for portion, record in (("test", "a"), ("validation", "b"))
        for setting, wanted in ((1, 8), (5, 1))
    ]
    for number in (40, 80):
        actual = np.repeat(["accent", "non_accent"], number)
        for method in accents.FEATURES:
            wrong = rng.random(2 * number) < 0.25
            labels = np.where(wrong, actual[::-1], actual)
            found.append(detections("accents", method, number, labels, actual))
    hands = np.array(["left", "right", "straight"] * 6)
    found.append(detections("hand", "HMM", 5, np.where(np.arange(18) < 4, "left", hands), hands))
    found += [detections("head", "HMM", states, ["nod", "tilt"] * states, None) for states in (2, 4)]
    table = pd.concat(found, ignore_index=True)
    return directions.scores(table, events, records, ["left"], directions.Settings(200, 0.95), 1)


@pytest.fixture(scope="module")
def sources():
    rng = np.random.default_rng(2)
    start = np.sort(rng.uniform(0.0, 900.0, 200))
    events = np.column_stack([start, start + 0.2])
    gestures = events[::2] + np.array([-0.05, 0.3])
    settings = Settings(shifts=100, level=0.95)
    kinds = (("accents", "head"), ("keywords", "hand"))
    return {
        "direction_scores": scores(),
        "co_occurrence": pd.concat(
            [co_occurrence.table(*kind, events, gestures, 905.0, settings, 1) for kind in kinds], ignore_index=True
        ),
        "co_occurrence_pairs": pd.concat(
            [co_occurrence.pairs(*kind, events, gestures, 905.0) for kind in kinds], ignore_index=True
        ),
    }


def test_made_up_sources_have_their_schemas(sources):
    for name, table in sources.items():
        tables.validate(table, exhibits.SOURCES[name].schema, name)


@pytest.mark.parametrize("exhibit", [one for one in exhibits.DIRECTIONS if one.show], ids=lambda one: one.name)
def test_every_exhibit_is_drawn_shown_and_compared(exhibit, sources, tmp_path):
    given = {argument: sources[name] for argument, name in exhibit.sources.items()}
    drawn = declaration.load(exhibit.draw)(RUN, **given)
    assert (drawn.figure is not None) == exhibit.figure
    drawn.numbers.to_csv(tmp_path / "numbers.csv", index=False)
    numbers = pd.read_csv(tmp_path / "numbers.csv")
    table = declaration.load(exhibit.show)(RUN, numbers)
    assert table.rows
    assert all(len(row) == len(table.headings) for row in table.rows)
    pairs = declaration.load(exhibit.compare)(RUN, numbers, RUN.published[exhibit.published])
    assert pairs
    assert not any("nan" in text for pair in pairs for text in pair)


def test_the_animation_is_drawn_and_its_speed_compared():
    time_s = np.arange(90) / 30.0
    share = np.where((time_s >= 1.0) & (time_s < 1.2), (time_s - 1.0) / 0.2, np.nan)
    hands = dict.fromkeys(["left_x_m", "left_y_m", "right_x_m", "right_y_m"], np.where(np.isfinite(share), 0.2, 0.0))
    table = pd.DataFrame(
        {"record": "a", "frame": np.arange(90), "time_s": time_s,
         "keyword": np.where(np.isfinite(share), "left", None), "keyword_share": share,
         "accent_share": share, **hands,
         "head_px": 25.0 * np.maximum(np.minimum(time_s - 1.0, 1.2 - time_s), 0.0)}
    )  # fmt: skip
    tables.validate(table, "direction_animation", "animation")
    drawn = chapter3.animation(RUN, table)
    head, hands = drawn.figure.axes
    assert len(head.lines) == 1
    assert [text.get_text() for text in hands.texts] == ["left"]
    speed, reach = chapter3.compare_animation(RUN, table, RUN.published["head-text-3-animation"])
    assert (speed.published, speed.ours) == ("25", "25.0")
    assert reach.ours == "2.5"


def test_the_number_of_gaussians_is_that_of_the_validated_records(sources):
    assert chapter3.chosen_gaussians(sources["direction_scores"]) == 5
    swapped = sources["direction_scores"].copy()
    validated = swapped["portion"] == "validation"
    swapped.loc[validated, "setting"] = 6 - swapped.loc[validated, "setting"]
    assert chapter3.chosen_gaussians(swapped) == 1


def test_shares_of_false_alarms_are_turned_around_and_differences_change_sign(sources):
    drawn = chapter3.accents(RUN, sources["direction_scores"]).numbers
    before = sources["direction_scores"].loc[drawn.index]
    false = before["measure"] == "false_alarm"
    assert np.allclose(drawn["value"][~false], before["value"][~false])
    single = before["other"].isna()
    assert np.allclose(drawn["value"][false & single], 1.0 - before["value"][false & single])
    assert np.allclose(drawn["value"][false & ~single], -before["value"][false & ~single])
    assert (drawn["low"] <= drawn["value"]).all()
    assert (drawn["value"] <= drawn["high"]).all()


def test_the_findings_say_what_the_numbers_allow(sources):
    correlation, overlap, features, keywords = page.findings(sources["direction_scores"], sources["co_occurrence"])
    assert "shows nothing" in correlation.claim
    assert overlap.claim.startswith("57 % of the accents overlap a head gesture")
    none = sources["co_occurrence"].assign(value=sources["co_occurrence"]["chance"])
    assert page.findings(sources["direction_scores"], none)[1].claim.endswith("no more often than by chance.")
    assert "With 40 accents" in features.claim
    assert keywords.claim.startswith("10 % of the keywords")

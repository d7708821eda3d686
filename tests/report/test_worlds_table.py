"""The cross table of systems and worlds: its cells, what is expected of them, and which deviations are findings."""

import numpy as np
import pandas as pd
import plausible
import pytest
from matplotlib import pyplot as plt

from cospeech.report import systems
from cospeech.report.exhibits import worlds
from cospeech.report.exhibits.run import Run
from cospeech.report.page import findings
from cospeech.workflow.config import ActorWorld

MADE_UP = {
    "chain": ("Özkul 2012, chapter 5", True),
    "mover": ("Levine et al. 2010, section 7", False),
    "speaker": ("Levine 2009, 4.3", False),
}
"""Systems, one for each world: the source of the method, and whether it plans phrases."""

SYSTEMS = systems.from_params(
    {
        name: {"title": name.title(), "role": "system", "controls": [f"{name}_1", f"{name}_2"], "plans": plans}
        | {"source": source}
        for name, (source, plans) in MADE_UP.items()
    }
    | {f"{name}_{k}": {"title": f"{name} {k}", "role": "control"} for name in MADE_UP for k in (1, 2)}
)
RUN = Run(SYSTEMS, {}, [], [], {}, plausible.RUN.published)
WORLDS = {
    "a": ActorWorld("phrases", 0.8, {}),
    "b": ActorWorld("vigour", 0.8, {}),
    "c": ActorWorld("syllables", 0.8, {}),
    "d": ActorWorld("all", 0.8, {}),
    "e": ActorWorld("vigour", 0.0, {}),
    "f": ActorWorld("all", 0.0, {"vigour": 0.5}),
}
HOME = {"chain": "phrases", "mover": "vigour", "speaker": "syllables"}


SCORES = pd.DataFrame(
    [
        {"actor": actor, "record": record, "measure": measure, "part": part, "recorded": value + extra}
        for actor in WORLDS
        for record, extra in (("r1", 0.0), ("r2", 0.02), ("r2", 0.02))
        for measure, value in (("beat_alignment", 0.04), ("frechet_distance", 1.5), ("kappa", np.nan))
        for part in ("interior",)
    ]
)
"""What the recorded motion reaches, in one row per system, of which the second record has two."""


def differences(gains, n_records=6):
    """Return a table in which each interval is 0.1 wide on either side of the gain, by system, actor and measure."""
    rows = [
        {"system": name, "other": other, "actor": actor, "phrases": phrases, "measure": measure, "part": part}
        | {"difference": gain, "low": gain - 0.1, "high": gain + 0.1, "n": n_records}
        | {"p_value": 1e-4 if abs(gain) > 0.25 else 0.03 if abs(gain) > 0.1 else 0.5}
        for name in MADE_UP
        for other, wrong in ((f"{name}_2", 0.0), (f"{name}_1", 9.0))
        for actor in [*WORLDS, "all"]
        for measure in worlds.MEASURES
        for part, more in (("interior", 0.0), ("whole", 9.0))
        for phrases, extra in (("seen", 0.0), ("planned", 9.0))
        if phrases == "seen" or SYSTEMS[name].plans
        for sign in [-1.0 if measure == "frechet_distance" else 1.0]
        for gain in [sign * gains.get((name, actor, measure), 0.0) + wrong + more + extra]
    ]
    return pd.DataFrame(rows)


def as_expected():
    return {
        (name, actor, measure): 0.3
        for name, home in HOME.items()
        for actor in ("a", "b", "c")
        for measure in worlds.PLANTED[WORLDS[actor].world]
        if WORLDS[actor].world == home
    }


def claims(gains):
    cells = worlds.cells(RUN, differences(gains), SCORES, WORLDS)
    return [finding.claim for finding in findings._in_worlds(cells, 0.95)]


def test_cells_are_the_interior_and_seen_advantages_over_the_strictest_control():
    rng = np.random.default_rng(1)
    gains = {
        (name, actor, measure): rng.normal() for name in MADE_UP for actor in WORLDS for measure in worlds.MEASURES
    }
    cells = worlds.cells(RUN, differences(gains), SCORES, WORLDS)
    assert len(cells) == len(gains)
    for _, cell in cells.iterrows():
        gain = gains[cell["system"], cell["actor"], cell["measure"]]
        assert cell["advantage"] == pytest.approx(gain)
        assert cell["found"] == ("gain" if gain > 0.1 else "loss" if gain < -0.1 else "none")


def test_gains_are_expected_at_home_and_none_at_coupling_0():
    cells = worlds.cells(RUN, differences({}), SCORES, WORLDS)
    home = cells[cells["expected"] == "gain"]
    assert set(zip(home["system"], home["actor"], home["measure"], strict=True)) == set(as_expected())
    assert set(cells.loc[cells["expected"] == "none", "actor"]) == {"e"}


def test_planned_phrases_stand_in_where_the_control_has_no_motion():
    table = differences({})
    unseen = table[(table["system"] != "chain") | (table["phrases"] == "planned")]
    cells = worlds.cells(RUN, unseen, SCORES, WORLDS)
    assert set(cells.loc[cells["system"] == "chain", "phrases"]) == {"planned"}
    assert set(cells.loc[cells["system"] != "chain", "phrases"]) == {"seen"}


def test_the_findings_name_every_deviation_and_no_other():
    fine = claims(as_expected())
    assert fine == [
        "Where speech tells what a system assumes, it gains from speech in 7 of 7 measures.",
        "At coupling 0, 0 of 15 intervals exclude 0; by chance, about 0.8 would. Corrected for the number of "
        "comparisons, no deviation remains.",
    ]
    deviating = as_expected() | {
        ("mover", "b", "hand_speed_r"): 0.05,
        ("speaker", "a", "kappa"): 0.5,
        ("chain", "c", "kappa"): 0.35,  # more than the speaker, but within its interval
        ("chain", "b", "kappa"): -0.2,
        ("mover", "e", "boundary_f1"): 0.2,
        ("chain", "e", "boundary_f1"): -0.3,
    }
    assert claims(deviating) == [
        "Where speech tells what a system assumes, it gains from speech in 6 of 7 measures.",
        "Deviation: in hand speed r in the world vigour at coupling 0.8, “Mover” does not gain from the speech that "
        "it assumes.",
        "Deviation: in kappa in the world phrases at coupling 0.8, “Speaker” gains more than “Chain”, whose "
        "world it is.",
        "Deviation: in kappa in the world vigour at coupling 0.8, “Chain” does worse by its own speech.",
        "At coupling 0, 2 of 15 intervals exclude 0; by chance, about 0.8 would. Corrected for the number of "
        "comparisons, 1 deviation remains.",
    ]


@pytest.mark.parametrize("n_records", [0, 3])
def test_without_intervals_or_records_nothing_is_claimed(n_records):
    table = differences(as_expected(), n_records)
    if not n_records:
        table = table.assign(low=np.nan, high=np.nan)
    cells = worlds.cells(RUN, table, SCORES, WORLDS)
    assert n_records or set(cells["found"]) == {"unknown"}
    (finding,) = findings._in_worlds(cells, 0.95)
    assert "too few records" in finding.claim


def test_the_figure_and_the_table_show_every_system_in_every_world():
    numbers = worlds.cells(RUN, differences(as_expected()), SCORES, WORLDS)
    drawn = worlds.figure(numbers)
    assert len(drawn.axes) == len(MADE_UP) * len(WORLDS)
    assert [axes.get_title(loc="left") for axes in drawn.axes[:2]] == [
        "phrases,\ncoupling 0.8",
        "vigour,\ncoupling 0.8",
    ]
    plt.close(drawn)
    shown = worlds.table(RUN, numbers)
    assert shown.headings[2] == "a: world phrases, coupling 0.8"
    assert [row[:3] for row in shown.rows[:4]] == [
        ["recorded motion (value)", "beat alignment", "0.05"],
        ["recorded motion (value)", "Fréchet distance", "1.51"],
        ["Chain", "hand speed r", "+0.00 (−0.10 to +0.10)"],
        ["Chain", "kappa", "+0.30* (+0.20 to +0.40)"],
    ]

"""The exhibits and findings of speaker identification, from made-up tables."""

import numpy as np
import pandas as pd
import plausible
import pytest

from cospeech.data import tables
from cospeech.report import exhibits
from cospeech.report.exhibits import declaration, identity
from cospeech.report.page import captions
from cospeech.report.page import identity as page

RUN = plausible.RUN
THRESHOLDS = (0.0, 0.25, 0.5)


def rates(best="audio + weak", control_gain=1.0):
    rows = []
    for session in (None, "1", "2"):
        for kind in ("as printed", "usual"):
            for number, condition in enumerate(identity.CONDITIONS):
                for strategy in dict.fromkeys([*identity.STRATEGIES, *identity.SCHEMES]):
                    plain = strategy not in identity.SCHEMES
                    if plain and condition != "paired":
                        continue
                    for place, threshold in enumerate([np.nan] if plain else THRESHOLDS):
                        eer = 2.0 + place + control_gain * number - (strategy == best)
                        strategy_at = (session, condition, strategy, threshold, None if plain else 39 - 10 * place)
                        rows.append((*strategy_at, kind, eer, eer - 0.5, eer + 0.5, 100))
    columns = [
        "session",
        "condition",
        "strategy",
        "threshold",
        "dimension",
        "rates",
        "eer_pct",
        "low",
        "high",
        "trials",
    ]
    return pd.DataFrame(rows, columns=columns).astype({"dimension": "Int64"})


def gains(low):
    rows = [("audio + weak", "audio", "paired"), ("audio + weak", "audio + weak", "whitened")]
    return pd.DataFrame(
        [{"strategy": one, "other": other, "condition": condition, "gain": low + 0.5, "low": low, "high": low + 1.0,
          "populations": 20} for one, other, condition in rows]
    )  # fmt: skip


DELAY = pd.DataFrame(
    {"delay_ms": [41.0], "low_ms": [36.0], "high_ms": [45.0], "p_value": [0.025], "chance": [1.5], "pieces": [80],
     "doubt": [None], "shift": [4], "planted_ms": [40.0]}
)  # fmt: skip

SOURCES = {
    "delay": DELAY,
    "delay_curve": pd.DataFrame({"shift_ms": np.arange(-200.0, 201.0, 10.0), "measure": np.hanning(41) + 2.0}),
    "shift_rates": pd.DataFrame(
        {"shift_ms": [0, 40] * 2, "rates": ["as printed"] * 2 + ["usual"] * 2, "eer_pct": [5.0, 4.0] * 2,
         "low": [3.0] * 4, "high": [7.0] * 4}
    ),
    "canonical_correlations": pd.DataFrame(
        {"session": ["1"] * 3 + ["2"] * 3, "pair": [1, 2, 3] * 2, "correlation": [0.7, 0.3, 0.01] * 2}
    ),
    "equal_error_rates": rates(),
    "det": pd.DataFrame(
        {"strategy": ["audio"] * 6, "threshold": np.nan, "rates": ["as printed"] * 3 + ["usual"] * 3,
         "point": [0, 1, 2] * 2, "false_accept_pct": [0.0, 5.0, 100.0] * 2, "false_reject_pct": [100.0, 5.0, 0.0] * 2}
    ),
    "gains": gains(0.1),
}  # fmt: skip


@pytest.mark.parametrize("exhibit", exhibits.IDENTITY, ids=lambda one: one.name)
def test_every_exhibit_is_drawn_shown_and_compared(exhibit):
    for name in exhibit.sources.values():
        tables.validate(SOURCES[name], exhibits.SOURCES[name].schema, name)
    sources = {argument: SOURCES[name] for argument, name in exhibit.sources.items()}
    drawn = declaration.load(exhibit.draw)(RUN, **sources)
    assert (drawn.figure is not None) == exhibit.figure
    assert len(drawn.numbers)
    if exhibit.show:
        assert declaration.load(exhibit.show)(RUN, drawn.numbers)
    if exhibit.compare:
        assert declaration.load(exhibit.compare)(RUN, drawn.numbers, RUN.published[exhibit.published])
    caption = plausible.ROOT / "reports/template/captions" / f"{exhibit.name}.rst"
    assert captions.read(str(caption)).title


def test_the_first_finding_claims_a_gain_only_beyond_everything():
    proven = page.findings(rates(), DELAY, gains(0.1))[0]
    assert proven.claim.startswith("Fusion by canonical correlation analysis gains more than all of its controls")
    missed = gains(0.1)
    missed.loc[1, "low"] = -0.1
    null = page.findings(rates(), DELAY, missed)[0]
    assert null.claim.startswith("No gain")
    assert "not “whitening alone”" in null.evidence[0]
    assert "not tested" in page.findings(rates(), DELAY, None)[0].claim


def test_controls_that_do_as_well_are_counted():
    assert page.findings(rates(control_gain=0.0), DELAY, None)[2].claim.startswith("In 6 of 6 fusion schemes")
    assert page.findings(rates(control_gain=9.0), DELAY, None)[2].claim.startswith("In 0 of 6 fusion schemes")


def test_a_delay_that_cannot_be_told_is_not_told():
    doubtful = DELAY.assign(doubt="voice or lips do not change")
    assert page.findings(rates(), doubtful, None)[3].claim == "The delay between voice and lips cannot be told."


def test_table_2_1_has_published_values_next_to_ours_at_the_same_threshold():
    numbers = identity.schemes(RUN, SOURCES["equal_error_rates"]).numbers
    shown = identity.scheme_table(RUN, numbers)
    weak = shown.groups[3]
    assert weak.title == "f_A + Σ f̃_ALi"
    assert [line.title for line in weak.lines[:2]] == ["this run", "published"]
    assert [cell.value for cell in weak.lines[0].cells] == ["1.0", "2.0", "3.0"]
    assert [cell.value for cell in weak.lines[1].cells] == ["0.4", "0.7", "4.3"]
    assert len(weak.lines) == 2 + len(identity.CONTROLS) + 1

"""Rows of the score tables that the report compares."""

from __future__ import annotations

import pandas as pd

from cospeech.report.systems import Systems


def at_main(scores: pd.DataFrame, systems: Systems) -> pd.DataFrame:
    """Return the scores of every system at its main variant."""
    main = {name: system.variant for name, system in systems.items()}
    return scores[scores["variant"] == scores["system"].map(main)]


def own_phrases(scores: pd.DataFrame, systems: Systems) -> pd.DataFrame:
    """Return the scores of the phrases that a system planned, or that were seen in its motion if it plans none."""
    plans = scores["system"].map({name: system.plans for name, system in systems.items()})
    return scores[scores["phrases"] == plans.map({True: "planned", False: "seen"})]


def common_phrases(differences: pd.DataFrame, systems: Systems) -> pd.DataFrame:
    """Return differences of planned phrases, or of seen ones if one of the two systems plans none."""
    plans = {name: system.plans for name, system in systems.items()}
    planned = [plans.get(one, False) and plans.get(two, False)
               for one, two in zip(differences["system"], differences["other"], strict=True)]  # fmt: skip
    return differences[
        differences["phrases"] == pd.Series(planned, differences.index).map({True: "planned", False: "seen"})
    ]

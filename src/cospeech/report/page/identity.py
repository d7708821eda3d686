"""What the page of a run that identifies speakers says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from cospeech.report import words
from cospeech.report.exhibits.identity import (
    CONDITIONS,
    CONTROLS,
    PAIRED,
    PRINTED,
    SCHEMES,
    STRATEGIES,
    USUAL,
    best_of,
    interval,
    percent,
    pooled,
)
from cospeech.report.exhibits.run import Run
from cospeech.report.page import sections
from cospeech.report.page.findings import Finding
from cospeech.report.page.provenance import Banner
from cospeech.report.page.sections import Shown

Config = dict[str, Any]

LEAD = (
    "Who is speaking? A person says a name in front of a camera. A system that knows some speakers by voice and lips "
    "says which of them it is, or that it is nobody known. This page shows how well that works, and whether it helps "
    "to fuse voice and lips by canonical correlation analysis."
)

DOCUMENT = (
    "Mehmet Emre Sargin", "Audio-Visual Correlation Modeling for Speaker Identification and Synthesis",
    "master's thesis, Koç University, August 2006",
)  # fmt: skip


def content(run: Run, config: Config, tables: Mapping[str, pd.DataFrame], shown: Sequence[Shown]) -> dict[str, Any]:
    """Return what the template of the page uses, apart from what the run lacks.

    Parameters
    ----------
    run : the run.
    config : its configuration.
    tables : sources by name: clips, delay, equal_error_rates, and gains where the run has them.
    shown : the exhibits.
    """
    return {
        "run": run,
        "lead": LEAD,
        "document": DOCUMENT,
        "config": config,
        "banner": banner(config, tables["clips"]),
        "headline": None,
        "viewer": None,
        "findings": findings(tables["equal_error_rates"], tables["delay"], tables.get("gains")),
        "parts": sections.parts(shown),
        "notes": [],
        "facts": facts(config, tables["clips"]),
        "links": {one.exhibit.name: one.exhibit.files for one in shown},
    }


def banner(config: Config, clips: pd.DataFrame) -> Banner:
    """Return what the corpus is: a virtual population, or recordings of people."""
    own = clips[clips["own_name"]]
    size = (
        f"{words.counted(int(own['speaker'].nunique()), 'speaker')}, {words.counted(len(own), 'clip')} of their own "
        f"names and {len(clips) - len(own)} of other names"
    )
    if config["identity"]["sheet"]:
        return Banner("real", f"Real recordings: the corpus “{config['corpus']['name']}”.", [f"{size}."])
    population = config["studio"]["population"]
    made = (
        "A speech synthesiser spoke, and faces were drawn and filmed."
        if population["film"]
        else "A speech synthesiser spoke; the features of the lips were drawn by a program."
        if population["sound"]
        else "A program drew the features of voices and lips; there is neither sound nor film."
    )
    return Banner(
        "virtual",
        "Everything here is virtual: nobody was recorded.",
        [
            f"{size}. {made} By design, {100 * population['shared']:g} % of the lip movements follow the phones that "
            f"are spoken (shared {population['shared']:g}; own of the voice {population['own_voice']:g}, of the lips "
            f"{population['own_lips']:g}).",
            "These numbers show how well the methods recover what was planted. They say nothing about people, and "
            "their values are not comparable with published ones, which come from recordings.",
        ],
    )


def findings(rates: pd.DataFrame, delay: pd.DataFrame, gains: pd.DataFrame | None) -> list[Finding]:
    """Return the findings, whether fusion gains anything first.

    Parameters
    ----------
    rates, delay, gains : the tables ``equal_error_rates``, ``delay`` and ``gains``; without the last one, no gain is
        claimed.
    """
    return [_gain(gains), _best(rates), _controls(rates), _delay(delay.iloc[0])]


def _gain(gains: pd.DataFrame | None) -> Finding:
    if gains is None:
        return Finding(
            "Whether fusion by canonical correlation analysis gains anything was not tested.",
            ["a gain must show over many populations; this run has only one"],
        )
    proven, evidence = [], []
    for strategy, own in gains.groupby("strategy", sort=False):
        missed = own[~(own["low"] > 0.0)]
        least = own.sort_values("low", kind="stable").iloc[0]
        title = SCHEMES[str(strategy)]
        if missed.empty:
            proven.append(title)
        names = [_name(row) for _, row in missed.iterrows()]
        evidence.append(
            f"{title}: beats {len(own) - len(missed)} of {len(own)} alternatives over "
            f"{int(own['populations'].max())} populations"
            + (f"; not {words.joined(names, 'or')}" if names else "")
            + f"; smallest gain {least['gain']:+.2f} points ({least['low']:+.2f} to {least['high']:+.2f}), over "
            f"{_name(least)}".replace("-", "−")
        )
    claim = (
        f"Fusion by canonical correlation analysis gains more than all of its controls: {words.joined(proven)}."
        if proven
        else "No gain: fusion by canonical correlation analysis does not beat all of its controls and the simpler "
        "strategies."
    )
    return Finding(claim, evidence)


def _name(row: pd.Series) -> str:
    known = STRATEGIES if row["condition"] == PAIRED else CONDITIONS
    return f"“{known[row['other'] if row['condition'] == PAIRED else row['condition']]}”"


def _best(rates: pd.DataFrame) -> Finding:
    evidence = []
    rows = {}
    for kind in (PRINTED, USUAL):
        own = pooled(rates, kind)
        found = [row for strategy in STRATEGIES if (row := best_of(own, PAIRED, strategy)) is not None]
        if not found:
            continue
        rows[kind] = min(found, key=lambda row: row["eer_pct"])
        audio = best_of(own, PAIRED, "audio")
        least = rows[kind]
        evidence.append(
            f"rates {kind}: {STRATEGIES[least['strategy']]} {percent(least['eer_pct'])} % ({interval(least)})"
            + (f", audio alone {percent(audio['eer_pct'])} % ({interval(audio)})" if audio is not None else "")
        )
    if not rows:
        return Finding("No error rate can be computed: there are no impostors.", [])
    evidence.append("the threshold of each strategy is the best one on the tested clips, as in the document")
    first = rows.get(PRINTED, next(iter(rows.values())))
    return Finding(
        f"The lowest equal error rate is {percent(first['eer_pct'])} %: {STRATEGIES[first['strategy']]}.", evidence
    )


def _controls(rates: pd.DataFrame) -> Finding:
    own = pooled(rates)
    evidence, matched = [], 0
    for strategy, title in SCHEMES.items():
        paired = best_of(own, PAIRED, strategy)
        controls = [row for name in CONTROLS if (row := best_of(own, name, strategy)) is not None]
        if paired is None or not controls:
            continue
        strictest = min(controls, key=lambda row: row["eer_pct"])
        matched += bool(strictest["eer_pct"] <= paired["high"])
        evidence.append(
            f"{title}: {percent(paired['eer_pct'])} % ({interval(paired)}), strictest control "
            f"{percent(strictest['eer_pct'])} % ({CONDITIONS[strictest['condition']]})"
        )
    return Finding(
        f"In {matched} of {len(evidence)} fusion schemes, a transform that was trained on something else does as "
        "well, within the interval.",
        evidence,
    )


def _delay(delay: pd.Series) -> Finding:
    if pd.notna(delay["doubt"]):
        return Finding("The delay between voice and lips cannot be told.", [str(delay["doubt"])])
    planted = delay["planted_ms"]
    return Finding(
        f"The voice lags {delay['delay_ms']:.0f} ms behind the lips.",
        [
            f"interval {delay['low_ms']:.1f} to {delay['high_ms']:.1f} ms, from {delay['pieces']} pieces of 0.5 s",
            *([f"planted: {planted:.0f} ms"] if pd.notna(planted) else []),
            "published: 40 ms",
        ],
    )


def facts(config: Config, clips: pd.DataFrame) -> list[tuple[str, str]]:
    """Return the facts behind the numbers as pairs of a term and its description."""
    identity = config["identity"]
    models, level = identity["word_models"], config["evaluation"]["bootstrap"]["level"]
    rates = ", ".join(f"{fps:g}" for fps in sorted(clips["fps"].unique()))
    return [
        (
            "features",
            f"13 MFCC with first and second derivatives at 100 Hz; 50 DCT coefficients of the lip region at {rates} "
            "frames/s, by cubic splines at 100 Hz",
        ),
        (
            "word models",
            f"left-to-right HMMs with {models['states']} states and diagonal Gaussians, one for each speaker and one "
            "for the world; the document does not state its numbers of states and Gaussians",
        ),
        (
            "sessions",
            "the clips of each speaker's own name are halved in two ways, and each half is trained on in turn; all "
            "clips of other names are tested as impostors. “All sessions” puts their trials under one threshold",
        ),
        (
            "rates as printed",
            "equation 2.4: FAR = F_a / (N_a + N_r), where clients who are taken for somebody else count as false "
            "accepts; FRR = F_r / N_a",
        ),
        (
            "usual rates",
            "FAR: share of impostors that are accepted; FRR: share of clients that are rejected or taken for "
            "somebody else",
        ),
        (
            "intervals",
            f"{100 * level:g} %, {config['evaluation']['bootstrap']['samples']} bootstrap samples of speakers",
        ),
        (
            "controls",
            "the transform alone is trained on something else, in as many dimensions; the word models are always "
            f"trained and tested with the right lips. {'; '.join(CONDITIONS[name] for name in identity['controls'])}",
        ),
        ("ceiling", "transform and word models are trained on the tested clips of clients as well"),
        ("seed", str(config["seed"])),
    ]

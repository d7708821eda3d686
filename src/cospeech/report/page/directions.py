"""What the page of a run about route directions says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from cospeech.report import words
from cospeech.report.exhibits import chapter3
from cospeech.report.exhibits.chapter3 import FALSE_ALARM, RECOGNITION, interval, share
from cospeech.report.exhibits.run import Run
from cospeech.report.page import sections
from cospeech.report.page.findings import Finding
from cospeech.report.page.identity import DOCUMENT
from cospeech.report.page.provenance import Banner
from cospeech.report.page.sections import Shown

Config = dict[str, Any]

LEAD = (
    "Somebody gives route directions, and points, nods and tilts the head while speaking. A system finds keywords "
    "and pitch accents in the speech, recognises the gestures, and this page shows how well, and which of them "
    "coincide."
)


def content(run: Run, config: Config, tables: Mapping[str, pd.DataFrame], shown: Sequence[Shown]) -> dict[str, Any]:
    """Return what the template of the page uses, apart from what the run lacks.

    Parameters
    ----------
    run : the run.
    config : its configuration.
    tables : sources by name: direction_records, direction_scores and co_occurrence.
    shown : the exhibits.
    """
    return {
        "run": run,
        "lead": LEAD,
        "document": DOCUMENT,
        "config": config,
        "banner": banner(config, tables["direction_records"]),
        "findings": findings(tables["direction_scores"], tables["co_occurrence"]),
        "parts": sections.parts(shown),
        "notes": [],
        "headline": None,
        "viewer": None,
        "facts": facts(config, tables["direction_records"]),
        "links": {one.exhibit.name: one.exhibit.files for one in shown},
    }


def banner(config: Config, records: pd.DataFrame) -> Banner:
    """Return what the corpus is, and what was planted in it."""
    planted = config["studio"]["directions"]
    return Banner(
        "virtual",
        "Everything here is virtual: nobody was recorded.",
        [
            f"{words.counted(len(records), 'answer')}, {records['duration_s'].sum() / 60:.1f} minutes, of "
            f"{words.counted(records['voice'].nunique(), 'voice')} of a speech synthesiser; head and hands were "
            f"moved by a program. By design, {100 * planted['accents_with_head']:g} % of the pitch accents have a "
            f"head gesture and {100 * planted['keywords_with_hand']:g} % of the keywords a hand gesture.",
            "These numbers show how well the methods recover what was planted. They say nothing about people, and "
            "their values are not comparable with published ones, which come from recordings.",
        ],
    )


def findings(scores: pd.DataFrame, measures: pd.DataFrame) -> list[Finding]:
    """Return the findings, those about what the document claims first.

    Parameters
    ----------
    scores, measures : the tables ``direction_scores`` and ``co_occurrence``.
    """
    return [_correlation(measures), _overlap(measures), _features(scores), _keywords(scores)]


def _correlation(measures: pd.DataFrame) -> Finding:
    r, spread = (chapter3.measured(measures, "accents", name) for name in ("start_r", "onset_sd_s"))
    return Finding(
        "A correlation of 0.99 between the times of overlapping accents and gestures shows nothing.",
        [
            f"head gestures at other times, which are unrelated to speech, give "
            f"r = {r['chance']:.7f}; the actual ones give {r['value']:.7f}",
            f"the onset differences do tell: their standard deviation is {spread['value']:.3f} s, and "
            f"{spread['chance']:.3f} s ({spread['chance_low']:.3f} to {spread['chance_high']:.3f}) for those",
        ],
    )


def _overlap(measures: pd.DataFrame) -> Finding:
    rows = measures[measures["measure"] == "overlap"].set_index("speech")
    accents, beyond = rows.loc["accents"], rows["value"] > rows["chance_high"]
    evidence = [
        f"{chapter3.SPEECH[str(name)]}: {row['value']:.3f} ({interval(row)}) of {row['number']} {name}; gestures at "
        f"other times {row['chance']:.3f} ({row['chance_low']:.3f} to {row['chance_high']:.3f})"
        for name, row in rows.iterrows()
    ]
    if beyond["accents"]:
        return Finding(
            f"{100 * accents['value']:.0f} % of the accents overlap a head gesture; "
            f"{100 * accents['chance']:.0f} % would by chance.",
            evidence,
        )
    return Finding("Accents overlap head gestures no more often than by chance.", evidence)


def _features(scores: pd.DataFrame) -> Finding:
    own = scores[(scores["task"] == "accents") & scores["other"].notna()]
    fewest = own[own["setting"] == own["setting"].min()]
    clear = fewest[(fewest["low"] > 0.0) | (fewest["high"] < 0.0)]
    number = int(fewest["setting"].iloc[0])
    rates = chapter3.of(scores, "accents", RECOGNITION, setting=number)
    half = float((rates["high"] - rates["low"]).max()) / 2.0
    return Finding(
        f"With {number} accents, {len(fewest) - len(clear)} of {len(fewest)} differences between sets of features "
        "are within noise.",
        [f"a recognition rate of {number} accents is known to ±{half:.3f}"],
    )


def _keywords(scores: pd.DataFrame) -> Finding:
    gaussians = chapter3.chosen_gaussians(scores)
    found, false = (
        chapter3.of(scores, "keywords", measure, setting=gaussians).iloc[0] for measure in (RECOGNITION, FALSE_ALARM)
    )
    return Finding(
        f"{100 * found['value']:.0f} % of the keywords are found, with {100 * false['value']:.1f} % false alarms.",
        [
            f"found {share(found)}, {interval(found)}; other words mistaken for keywords {share(false)}, "
            f"{interval(false)}; {gaussians} Gaussians per state, chosen on validation answers",
        ],
    )


def facts(config: Config, records: pd.DataFrame) -> list[tuple[str, str]]:
    """Return the facts behind the numbers as pairs of a term and its description."""
    own, bootstrap = config["directions"], config["evaluation"]["bootstrap"]
    minutes = records.groupby("portion")["duration_s"].sum() / 60.0
    return [
        ("answers", ", ".join(f"{name} {value:.1f} min" for name, value in minutes.items())),
        (
            "keyword models",
            "13 MFCC with first and second derivatives at 100 Hz, normalised per answer; left-to-right HMMs with "
            f"{own['keywords']['states']} states for keywords and {own['keywords']['other_states']} for silence and "
            "other words, which the document does not state",
        ),
        (
            "accent models",
            f"left-to-right HMMs with {own['accents']['states']} states and {own['accents']['gaussians']} Gaussians; "
            "five partitions in the order of time are tested in turn",
        ),
        (
            "gesture models",
            f"left-to-right HMMs with {own['gestures']['hand_states']} states for hands; positions, angles and their "
            "change are the features, instead of the motion parameters of film",
        ),
        (
            "intervals",
            f"{100 * bootstrap['level']:g} %; of shares by Wilson (1927), of differences by {bootstrap['samples']} "
            f"bootstrap samples, of chance by {own['shifts']} circular shifts",
        ),
        ("seed", str(config["seed"])),
    ]

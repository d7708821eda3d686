"""What a reader needs to know to make the numbers again, in words: corpus, rates, folds, bins, seeds."""

from __future__ import annotations

from typing import Any, NamedTuple

import pandas as pd

from cospeech.report import words

Config = dict[str, Any]


class Banner(NamedTuple):
    """What is virtual and what is real, at the top of the page."""

    kind: str
    claim: str
    lines: list[str]


def banner(config: Config, records: pd.DataFrame, annotations: pd.DataFrame) -> Banner:
    """Return what the corpus is: virtual actors, or recordings of people.

    Parameters
    ----------
    config : the configuration.
    records, annotations : the tables of those names.
    """
    minutes = records["duration_s"].sum() / 60
    size = f"{records['actor'].nunique()} actors, {len(records)} records, {minutes:.1f} minutes"
    if config["corpus"]["source"] == "studio":
        return _virtual(config["studio"], size)
    labelled = annotations["origin"].value_counts()
    by = {
        "person": "labelled by a person",
        "rule": "proposed by rules that read the joint angles",
        "studio": "planted",
    }
    told = ", ".join(f"{labelled[origin]} {text}" for origin, text in by.items() if origin in labelled)
    examples = f"The gesture classes were learned from {told}." if told else "Gesture phrases were delivered with it."
    return Banner(
        "real",
        f"Real recordings: the corpus “{config['corpus']['name']}”.",
        [
            f"{size[0].upper()}{size[1:]}. {examples}",
            "The actual phrases that scores compare with were found by a program from those examples; nobody checked "
            "every one of them.",
        ],
    )


def _virtual(studio: dict[str, Any], size: str) -> Banner:
    made = (
        "A program drew their gestures and the melody of their speech; a speech synthesiser spoke it, and a noisy body moved to it."
        if studio["sound"]
        else "A program drew their gestures and speech features; neither voice nor body was made."
    )
    knob = studio["coupling"]
    told = (
        "nothing: at this setting no system should beat its controls"
        if knob == 0
        else f"something: the gesture decides the melody in {100 * knob:g} % of phrases"
    )
    return Banner(
        "virtual",
        "Everything here is virtual: nobody was recorded.",
        [
            f"{size[0].upper()}{size[1:]}. {made} Their speech tells of their gestures {told} (coupling {knob:g}).",
            "So these numbers say how well the methods find again what was planted. They say nothing about people, and "
            "they do not compare in height with published ones, which come from recordings.",
        ],
    )


def facts(config: Config, records: pd.DataFrame, statistics: pd.DataFrame | None) -> list[tuple[str, str]]:
    """Return the facts behind the numbers as pairs of a term and what holds of it.

    Parameters
    ----------
    config : the configuration.
    records : the table of that name.
    statistics : the motion statistics, or None where the corpus brings no motion.
    """
    speech, phrases, synthesis = config["speech"], config["phrases"], config["synthesis"]
    evaluation, prosody, gesture = config["evaluation"], phrases["prosody"], phrases["gesture"]
    rates = sorted(records["motion_fps"].dropna().unique())
    told = [
        (
            "prosody",
            f"frames of {words.seconds(speech['frame_s'])}, window {words.seconds(speech['window_s'])}; intensity, pitch lag "
            f"({speech['pitch_min_hz']:g} to {speech['pitch_max_hz']:g} Hz) and gain, and their differences; normalised for each record",
        ),
        (
            "gesture phrases",
            f"{len(gesture['labels'])} classes, {gesture['states']} states each, from angles of both arms and forearms"
            + (f" at {', '.join(f'{rate:g}' for rate in rates)} frames/s" if rates else ""),
        ),
        (
            "prosody clusters",
            f"{prosody['clusters']} of {prosody['states']} states, best of {prosody['restarts']} starts",
        ),
        (
            "folds",
            "one actor at a time, each record left out in turn; "
            + (
                "nothing of the held-out record reaches its model"
                if phrases["folds"] == "strict"
                else "prosody clusters see all records, as in the thesis"
            ),
        ),
        (
            "HSMM",
            f"durations to {synthesis['max_duration_s']:g} s in bins of one prosody frame, smoothing "
            f"{synthesis['durations']['smoothing']}, least probability {synthesis['floor']:g}, end of record: censoring "
            f"{synthesis['censoring']}; emission weight of the weighted form chosen within the training records",
        ),
        (
            "scores",
            f"on frames of {words.seconds(speech['frame_s'])}; S in bins of "
            f"{', '.join(words.seconds(b) for b in evaluation['bins_s'])}; a boundary counts as found within "
            f"{words.seconds(evaluation['boundary_tolerance_s'])}; the interior leaves out the first "
            f"{evaluation['interior']['head_s']:g} s and the last {evaluation['interior']['tail_s']:g} s",
        ),
        (
            "means and intervals",
            "S: mean over gestures and records; other measures: mean over records, weighted by duration. Intervals: "
            f"{evaluation['bootstrap']['samples']} bootstrap samples of records within actors, "
            f"{100 * evaluation['bootstrap']['level']:g} %, percentiles widened for few records; with four records they are "
            "the records' range",
        ),
    ]
    if statistics is not None:
        joints = ", ".join(name.replace("_", " ") for name in dict.fromkeys(statistics["joint"]))
        told.append(
            (
                "motion statistics",
                f"world positions of {joints} (the joint where each begins), {statistics['fps'].iloc[0]:g} frames/s, plain "
                f"differences without smoothing, {evaluation['speed_bins']} bins; m/s, m/s², m/s³",
            )
        )
    return [*told, ("seed", str(config["seed"]))]

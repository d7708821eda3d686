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


def banner(
    config: Config, records: pd.DataFrame, annotations: pd.DataFrame, cameras: pd.DataFrame | None = None
) -> Banner:
    """Return what the corpus is: virtual actors, or recordings of people.

    Parameters
    ----------
    config : the configuration.
    records, annotations : the tables of those names.
    cameras : the table of that name, where the corpus was filmed.
    """
    minutes = records["duration_s"].sum() / 60
    actors = words.counted(records["actor"].nunique(), "actor")
    size = f"{actors}, {words.counted(len(records), 'record')}, {minutes:.1f} minutes"
    if config["corpus"]["source"] == "studio":
        return _virtual(config, size, cameras)
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
            f"{size}. {examples}",
            "The actual phrases that scores compare with were found by a program from those examples; nobody checked "
            "every one of them.",
        ],
    )


def _virtual(config: Config, size: str, cameras: pd.DataFrame | None) -> Banner:
    studio = config["studio"]
    made = (
        "A program drew their gestures and the melody of their speech; a speech synthesiser spoke, and a body moved."
        if studio["sound"]
        else "A program drew their gestures and the features of their speech; neither voice nor body was made."
    )
    knob = studio["coupling"]
    told = (
        "nothing of their gestures, so that no system should beat its controls"
        if knob == 0
        else f"of their gestures in {100 * knob:g} % of the phrases"
    )
    return Banner(
        "virtual",
        "Everything here is virtual: nobody was recorded.",
        [
            f"{size}. {made} By plan, their speech tells {told} (coupling {knob:g}).",
            *(_filmed(config, cameras) if cameras is not None else ()),
            "So these numbers say how well the methods find again what was planted. They say nothing about people, "
            "and do not compare in height with published ones, which come from recordings.",
        ],
    )


def _filmed(config: Config, cameras: pd.DataFrame) -> list[str]:
    sizes = cameras[["width_px", "height_px"]].drop_duplicates().itertuples(index=False)
    size = " and ".join(f"{width} x {height}" for width, height in sizes)
    method = {"robust": "the robust tracker", "thesis": "the plain tracker of the thesis"}
    seen_by = words.counted(len(cameras), "virtual camera")
    tracker = method[config["capture"]["track"]["method"]]
    return [
        f"The body wore markers and was filmed by {seen_by}: pictures of {size} "
        f"pixels, {config['studio']['motion_fps']:g} frames/s. Its joint angles come from there, by {tracker}."
    ]


def facts(config: Config, records: pd.DataFrame, statistics: pd.DataFrame | None) -> list[tuple[str, str]]:
    """Return the facts behind the numbers as pairs of a term and what holds of it.

    Parameters
    ----------
    config : the configuration.
    records : the table of that name.
    statistics : the motion statistics, or None where the corpus brings no motion.
    """
    told = [*_features(config, records), *_models(config), *_scores(config)]
    if statistics is not None:
        joints = ", ".join(name.replace("_", " ") for name in dict.fromkeys(statistics["joint"]))
        told.append(
            (
                "motion statistics",
                f"world positions of the joints {joints} (forearm: the elbow, hand: the wrist), "
                f"{statistics['fps'].iloc[0]:g} frames/s, plain differences without smoothing, "
                f"{config['evaluation']['speed_bins']} bins; m/s, m/s², m/s³",
            )
        )
    return [*told, ("seed", str(config["seed"]))]


def _features(config: Config, records: pd.DataFrame) -> list[tuple[str, str]]:
    speech, gesture = config["speech"], config["phrases"]["gesture"]
    rates = ", ".join(f"{rate:g}" for rate in sorted(records["motion_fps"].dropna().unique()))
    return [
        (
            "speech",
            f"frames of {words.seconds(speech['frame_s'])}, window {words.seconds(speech['window_s'])}; intensity, "
            f"pitch lag ({speech['pitch_min_hz']:g} to {speech['pitch_max_hz']:g} Hz), pitch gain, "
            "and their differences; normalised within each record",
        ),
        (
            "gesture phrases",
            f"{len(gesture['labels'])} classes of {gesture['states']} states, from angles of arms and forearms"
            + (f" at {rates} frames/s" if rates else "")
            + "; scored against phrases that a model of all the actor's records found",
        ),
    ]


def _models(config: Config) -> list[tuple[str, str]]:
    phrases, synthesis = config["phrases"], config["synthesis"]
    strict = phrases["folds"] == "strict"
    return [
        (
            "prosody clusters",
            f"{phrases['prosody']['clusters']} of {phrases['prosody']['states']} states, the best of "
            f"{phrases['prosody']['restarts']} starts, without any gesture label",
        ),
        (
            "folds",
            "one actor at a time, each record left out in turn; "
            + ("nothing of it reaches the model" if strict else "prosody clusters see all records, as in the thesis"),
        ),
        (
            "HSMM",
            f"durations to {synthesis['max_duration_s']:g} s in bins of one speech frame, smoothing "
            f"{synthesis['durations']['smoothing']}, least probability {synthesis['floor']:g}, censoring "
            f"{synthesis['censoring']}; the emission weight was chosen within the training records",
        ),
    ]


def _scores(config: Config) -> list[tuple[str, str]]:
    evaluation = config["evaluation"]
    bins = ", ".join(words.seconds(width) for width in evaluation["bins_s"])
    return [
        (
            "scores",
            f"on frames of {words.seconds(config['speech']['frame_s'])}; S in bins of {bins}; a boundary counts as "
            f"found within {words.seconds(evaluation['boundary_tolerance_s'])}; the interior leaves out the first "
            f"{evaluation['interior']['head_s']:g} s and the last {evaluation['interior']['tail_s']:g} s of a record",
        ),
        (
            "means and intervals",
            "S: mean over gestures and records; other measures: mean over records, weighted by duration. "
            f"{100 * evaluation['bootstrap']['level']:g} % intervals: {evaluation['bootstrap']['samples']} bootstrap "
            "samples of records within actors, percentiles widened as few "
            "records need. Still, four records only give their range, which holds the true mean in 87 of 100 cases",
        ),
    ]

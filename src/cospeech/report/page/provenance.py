"""What a reader needs to know to reproduce the numbers, in words: corpus, rates, folds, bins, seeds."""

from __future__ import annotations

from typing import Any, NamedTuple

import pandas as pd

from cospeech.report import words
from cospeech.workflow.config import ActorWorld, actor_worlds

Config = dict[str, Any]

ORIGINS = {
    "person": "labelled by a person",
    "rule": "proposed by rules based on the joint angles",
    "studio": "planted",
}

TRACKERS = {"robust": "the robust tracker", "thesis": "the plain tracker of the thesis"}

WORLDS = {
    "phrases": "predicts gesture in {} of the phrases",
    "vigour": "tells how vigorously the hands move in {} of the time",
    "syllables": "tells when parts of gestures begin, and which, in {} of the time",
    "all": "predicts the class of a gesture in {} of the phrases, and its vigour and parts in as much of the time",
    "patterns": "tells which gestures the head makes, and when, in {} of the time",
}
"""What speech tells about gesture in each world of the studio, and how often."""


class Banner(NamedTuple):
    """What is virtual and what is real, at the top of the page."""

    kind: str
    claim: str
    lines: list[str]


def banner(
    config: Config, records: pd.DataFrame, annotations: pd.DataFrame | None, cameras: pd.DataFrame | None = None
) -> Banner:
    """Return what the corpus is: virtual actors, or recordings of people.

    Parameters
    ----------
    config : the configuration.
    records, annotations : the tables of those names; no annotations where nobody looks for gesture phrases.
    cameras : the table of that name, if the corpus was filmed.
    """
    minutes = records["duration_s"].sum() / 60
    actors = words.counted(records["actor"].nunique(), "actor")
    size = f"{actors}, {words.counted(len(records), 'record')}, {minutes:.1f} minutes"
    if config["corpus"]["source"] == "studio":
        return _virtual(config, size, records, cameras)
    phrases = [] if annotations is None else _actual_phrases(config, records, annotations)
    return Banner("real", f"Real recordings: the corpus “{config['corpus']['name']}”.", [f"{size}.", *phrases])


def _actual_phrases(config: Config, records: pd.DataFrame, annotations: pd.DataFrame) -> list[str]:
    """Return where the phrases of real recordings come from with which scores compare.

    A record without motion was delivered with its gesture phrases. In all others they were found by a gesture model,
    which learned from annotated examples, or from examples that rules proposed.
    """
    delivered = records.loc[records["motion_source"].isna(), "record"]
    found = []
    if len(delivered):
        which = (
            "The actual phrases" if len(delivered) == len(records) else f"The actual phrases of {_named(delivered)}"
        )
        found.append(f"{which}, with which scores compare, were delivered with the corpus.")
    if len(delivered) < len(records):
        which = "The actual phrases" if delivered.empty else "The other actual phrases"
        found.insert(
            0,
            f"{_examples(config, records, annotations)} {which}, with which scores compare, were found by a program "
            "that learned from these examples; nobody checked each of them.",
        )
    return found


def _examples(config: Config, records: pd.DataFrame, annotations: pd.DataFrame) -> str:
    """Return where the examples come from that gesture models learned from; rules propose them where others lack."""
    learned = "The gesture classes were learned from examples"
    count = annotations["origin"].value_counts()
    found = ", ".join(f"{count[origin]} {text}" for origin, text in ORIGINS.items() if origin in count)
    actor_of = records.set_index("record")["actor"]
    known = set(zip(annotations["record"].map(actor_of), annotations["gesture"], strict=True))
    gesture = config["phrases"]["gesture"]
    complete = all((actor, label) in known for actor in actor_of for label in gesture["labels"])
    if gesture["first_examples"] != "rules" or complete:
        return f"{learned}: {found}."
    if not found:
        return f"{learned} that rules proposed from the joint angles."
    return f"{learned}: {found}. Where an actor had none of a class, rules proposed examples from the joint angles."


def _named(records: pd.Series) -> str:
    """Return a few records by name, and many by their number."""
    names = [str(name) for name in records]
    return words.joined(names) if len(names) <= 8 else words.counted(len(names), "record")


def _virtual(config: Config, size: str, records: pd.DataFrame, cameras: pd.DataFrame | None) -> Banner:
    studio = config["studio"]
    made = (
        "A program drew their gestures and the melody of their speech; a speech synthesiser spoke, and a body moved."
        if studio["sound"]
        else "A program drew their gestures and the features of their speech, and a body moved; there is no voice."
        if studio["motion"]
        else "A program drew their gestures and the features of their speech; there is neither voice nor body."
    )
    actors_of: dict[str, list[str]] = {}
    for actor, world in actor_worlds(studio).items():
        actors_of.setdefault(_planned(world), []).append(actor)
    if len(actors_of) == 1:
        planned = f"speech {next(iter(actors_of))}"
    else:
        of_actors = (f"that of {words.joined(actors)} {text}" for text, actors in actors_of.items())
        planned = f"what speech tells differs between the actors: {'; '.join(of_actors)}"
    return Banner(
        "virtual",
        "Everything here is virtual: nobody was recorded.",
        [
            f"{size}. {made} By design, {planned}.",
            *(_filmed(config, records, cameras) if cameras is not None else ()),
            "These numbers show how well the methods recover what was planted. They say nothing about people, and "
            "their values are not comparable with published ones, which come from recordings.",
        ],
    )


def _planned(own: ActorWorld) -> str:
    """Return what the speech of an actor tells about gesture, and how often."""
    planned = WORLDS[own.world].format(f"{100 * own.coupling:g} %")
    if own.coupling == 0 and not any(own.couplings.values()):
        planned = "does not predict gesture, so that no system should beat its controls"
    parts = "; ".join(f"{part}: {value:g}" for part, value in own.couplings.items())
    if own.world != "patterns" and own.head is not None:
        planned += f", and which gestures the head makes, and when, in {100 * own.head:g} % of the time"
    return f"{planned} (coupling {own.coupling:g}{parts and f'; {parts}'})"


def _filmed(config: Config, records: pd.DataFrame, cameras: pd.DataFrame) -> list[str]:
    """Return how the films of a virtual corpus were made, and which of its records were filmed."""
    filmed = records.loc[records["motion_source"] == "video", "record"]
    sizes = cameras[["width_px", "height_px"]].drop_duplicates().itertuples(index=False)
    size = words.joined([f"{width} x {height}" for width, height in sizes])
    studio = config["studio"]
    lines = [
        f"The body wore markers and was filmed by {words.counted(len(cameras), 'virtual camera')} at {size} pixels "
        f"and {studio['motion_fps']:g} frames/s. Its joint angles were computed from these films, with "
        f"{TRACKERS[config['capture']['track']['method']]}."
    ]
    if len(filmed) < len(records):
        lines.append(
            f"This was done for {_named(filmed)}. The joint angles of the other records are the planted ones, with "
            f"noise of {studio['motion_noise_deg']:g}\N{DEGREE SIGN}."
        )
    return lines


def facts(
    config: Config, records: pd.DataFrame, statistics: pd.DataFrame | None, phrases: bool = True, heads: bool = False
) -> list[tuple[str, str]]:
    """Return the facts behind the numbers as pairs of a term and its description.

    Parameters
    ----------
    config : the configuration.
    records : the table ``records``.
    statistics : the motion statistics, or None where the corpus has no motion.
    phrases, heads : whether systems of gesture phrases ran, and systems that move the head.
    """
    found = [*_features(config, records), *_models(config), *_scores(config)] if phrases else []
    found += _heads(config, records) if heads else []
    if statistics is not None:
        joints = ", ".join(name.replace("_", " ") for name in dict.fromkeys(statistics["joint"]))
        found.append(
            (
                "motion statistics",
                f"world positions of the joints {joints} (forearm: the elbow, hand: the wrist), "
                f"{statistics['fps'].iloc[0]:g} frames/s, finite differences without smoothing, "
                f"{config['evaluation']['speed_bins']} bins; m/s, m/s², m/s³",
            )
        )
    return [*found, ("seed", str(config["seed"]))]


def _heads(config: Config, records: pd.DataFrame) -> list[tuple[str, str]]:
    """Return the facts behind the scores of heads."""
    own = records["head_fps"].dropna()
    rates = own if len(own) else records["motion_fps"].dropna()
    evaluation = config["evaluation"]
    filmed = records["head_source"].isin(["stereo", "film"]).any()
    return [
        (
            "heads",
            "angles x (nod), y (turn) and z (tilt) of R = Rx Ry Rz in degrees, relative to "
            f"{'the first frame of the film' if filmed else 'the trunk'}, "
            f"at {', '.join(f'{rate:g}' for rate in sorted(rates.unique()))} frames/s",
        ),
        (
            "melody",
            "pitch, its slope and intensity at 100 Hz, minus their means over the utterances of a record and divided "
            "by their standard deviations there; noise of unit variance between utterances",
        ),
        (
            "scores of heads",
            "each record left out in turn. Controls are driven by the speech of up to 8 other records, and by the "
            f"own speech at up to 8 shifts of at least {config['synthesis']['shift_s']:g} s. Scores are means over "
            f"draws. {100 * evaluation['bootstrap']['level']:g} % intervals: "
            f"{evaluation['bootstrap']['samples']} bootstrap samples of records, or of minutes, within actors",
        ),
    ]


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
            f"{len(gesture['labels'])} classes with {gesture['states']} states each, from the joint angles of arms "
            "and forearms"
            + (f" at {rates} frames/s" if rates else "")
            + "; scored against phrases found by a model of all records of the actor",
        ),
    ]


def _models(config: Config) -> list[tuple[str, str]]:
    phrases = config["phrases"]
    strict = phrases["folds"] == "strict"
    return [
        (
            "prosody clusters",
            f"{phrases['prosody']['clusters']} with {phrases['prosody']['states']} states each, the best of "
            f"{words.counted(phrases['prosody']['restarts'], 'random initialisation')}, without any gesture labels",
        ),
        (
            "folds",
            "one actor at a time, each record left out in turn; "
            + ("nothing of it reaches the model" if strict else "prosody clusters see all records, as in the thesis"),
        ),
        ("synthesis settings", "; ".join(_settings(config["synthesis"]))),
    ]


def _settings(section: Config, above: str = "") -> list[str]:
    """Return the settings of a section as text, nested ones with the names above them."""
    found = []
    for key, value in section.items():
        name = f"{above}{key}"
        if isinstance(value, dict):
            found += _settings(value, f"{name}.")
        else:
            found.append(f"{name} {', '.join(f'{one}' for one in value) if isinstance(value, list) else value}")
    return found


def _scores(config: Config) -> list[tuple[str, str]]:
    evaluation = config["evaluation"]
    bins = ", ".join(words.seconds(width) for width in evaluation["bins_s"])
    return [
        (
            "scores",
            f"on frames of {words.seconds(config['speech']['frame_s'])}; S with bins of {bins}; a boundary counts as "
            f"found within {words.seconds(evaluation['boundary_tolerance_s'])}; the interior excludes the first "
            f"{evaluation['interior']['head_s']:g} s and the last {evaluation['interior']['tail_s']:g} s of a record",
        ),
        (
            "controls",
            "the same system driven by the speech of up to 8 other records of the actor, and by its own speech at up "
            f"to 8 shifts of at least {config['synthesis']['shift_s']:g} s; random phrases are drawn 8 times. Scores "
            "are averaged over these draws (systems that make motion themselves: one of each). The interior of a "
            "record is driven by the interior of its own or the other record, so that the pauses at the ends of "
            "records stay at the ends",
        ),
        (
            "means and intervals",
            "S: mean over gestures and records; other measures: mean over records, weighted by duration. "
            f"{100 * evaluation['bootstrap']['level']:g} % intervals: {evaluation['bootstrap']['samples']} bootstrap "
            "samples of records within actors, and of draws within records, percentiles widened to correct for few "
            "records. Even so, four records give little more than their range, which contains the true mean in 87 of "
            "100 cases",
        ),
        (
            "comparisons",
            "the findings call a difference in kappa or D better or worse if its interval excludes 0 and its p-value "
            "(t test with the bootstrap standard error), corrected by Holm's method for the number of these "
            f"comparisons, is at most {1 - evaluation['bootstrap']['level']:g}",
        ),
    ]

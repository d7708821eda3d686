"""How well keywords, accents and gestures are recognised in route directions (Sargin 2006, 3.2 and 3.3)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Flags
from cospeech.data.rng import random_source
from cospeech.metrics import proportions

ACCENT = "accent"
RECOGNITION, FALSE_ALARM = "recognition", "false_alarm"
KEYS = ["task", "method", "setting", "portion"]
COLUMNS = ["other", "label", "measure", "hits", "number", "value", "low", "high"]


class Settings(NamedTuple):
    """Number of bootstrap samples, and confidence level of intervals."""

    samples: int
    level: float


def scores(
    detections: pd.DataFrame,
    events: pd.DataFrame,
    records: pd.DataFrame,
    asked: list[str],
    settings: Settings,
    seed: int,
) -> pd.DataFrame:
    """Return all scores of a corpus (schema ``direction_scores``).

    Parameters
    ----------
    detections, events, records : the tables ``direction_detections``, ``direction_events`` and ``direction_records``.
    asked : the keywords.
    """
    found = []
    for (task, _, portion, _), own in detections.groupby(["task", "setting", "portion", "method"], sort=False):
        present = events[events["record"].isin(records[records["portion"] == portion]["record"])]
        if task == "keywords":
            found.append(keywords(own, present[present["tier"] == "word"], asked, settings.level))
        elif task == "head":
            found.append(head(own, present[present["tier"] == "head"], settings.level))
        elif task == "accents":
            found.append(accents(own, settings.level))
        else:
            found.append(classified(own, settings.level))
    for _, own in detections[detections["task"] == "accents"].groupby("setting"):
        found += accent_differences(own, settings, seed)
    return pd.concat(found, ignore_index=True).astype({"hits": "Int64"})


def _row(level: float, measure: str, hits: int, number: int, label: str | None = None) -> tuple[object, ...]:
    share = hits / number if number else np.nan
    return (None, label, measure, hits, number, share, *proportions.wilson(hits, number, level))


def _table(keys: list[str], rows: list[tuple[object, ...]]) -> pd.DataFrame:
    found = pd.DataFrame(rows, columns=COLUMNS)
    for place, (name, key) in enumerate(zip(KEYS, keys, strict=True)):
        found.insert(place, name, key)
    return found


def _matched(one: pd.DataFrame, others: pd.DataFrame) -> Flags:
    """Return which events of a table overlap one with the same label of another, in the same record."""
    found = np.zeros(len(one), dtype=bool)
    groups = dict(iter(others.groupby(["record", "label"])))
    for key, rows in one.reset_index(drop=True).groupby(["record", "label"]):
        if key in groups:
            times, theirs = (part[["start_s", "end_s"]].to_numpy() for part in (rows, groups[key]))
            found[rows.index] = proportions.partners(times, theirs)[0]
    return found


def _mistaken(words: pd.DataFrame, wrong: pd.DataFrame) -> Flags:
    """Return which words some wrong detection shares more time with than with any other word of the record."""
    found = np.zeros(len(words), dtype=bool)
    theirs = dict(iter(wrong.groupby("record")))
    for record, rows in words.reset_index(drop=True).groupby("record"):
        if record in theirs:
            spans = [part[["start_s", "end_s"]].to_numpy() for part in (theirs[record], rows)]
            overlapping, partner = proportions.partners(*spans)
            found[rows.index[partner[overlapping]]] = True
    return found


def keywords(detections: pd.DataFrame, words: pd.DataFrame, keywords: list[str], level: float) -> pd.DataFrame:
    """Return the scores of keyword spotting (schema ``direction_scores``).

    A keyword is recognised if a detection of it overlaps. Another word is mistaken for a keyword if a detection
    shares more time with it than with any other word, and overlaps no keyword with its label. Taking one keyword for
    another is a miss and not a false alarm. The document seems to count like this: 10 false alarms among 600.

    Parameters
    ----------
    detections : rows of a task of one setting and portion, of the table ``direction_detections``.
    words : the words of the records of that portion.
    """
    is_keyword = words["label"].isin(keywords)
    asked = words[is_keyword]
    found, mistaken = _matched(asked, detections), _mistaken(words, detections[~_matched(detections, asked)])
    each = [
        _row(level, RECOGNITION, int(found[own].sum()), int(own.sum()), name)
        for name in keywords
        for own in [(asked["label"] == name).to_numpy()]
    ]
    rows = [
        _row(level, RECOGNITION, int(found.sum()), len(asked)),
        *each,
        _row(level, FALSE_ALARM, int((mistaken & ~is_keyword.to_numpy()).sum()), int((~is_keyword).sum())),
    ]
    return _table(detections[KEYS].iloc[0].tolist(), rows)


def head(detections: pd.DataFrame, gestures: pd.DataFrame, level: float) -> pd.DataFrame:
    """Return the scores of gestures of the head that were spotted (schema ``direction_scores``).

    A gesture is recognised if a detection with its label overlaps. The share of false alarms is that of the
    detections that overlap no gesture with their label, as the document does not define its rate.

    Parameters
    ----------
    detections : as in ``keywords``.
    gestures : the gestures of the records of that portion.
    """
    found, right = _matched(gestures, detections), _matched(detections, gestures)
    rows = [
        _row(level, RECOGNITION, int(found.sum()), len(gestures)),
        _row(level, FALSE_ALARM, int((~right).sum()), len(right)),
    ]
    return _table(detections[KEYS].iloc[0].tolist(), rows)


def classified(detections: pd.DataFrame, level: float) -> pd.DataFrame:
    """Return the share of events of each label that are given this label (schema ``direction_scores``).

    Parameters
    ----------
    detections : as in ``keywords``; the actual label of each event is known.
    """
    right = (detections["label"] == detections["actual"]).to_numpy()
    rows = [
        _row(level, RECOGNITION, int(right[own].sum()), int(own.sum()), str(label))
        for label in sorted(detections["actual"].unique())
        for own in [(detections["actual"] == label).to_numpy()]
    ]
    return _table(detections[KEYS].iloc[0].tolist(), rows)


def accents(detections: pd.DataFrame, level: float) -> pd.DataFrame:
    """Return the share of accents that are recognised, and of other syllables that are taken for one.

    Parameters
    ----------
    detections : as in ``classified``.
    """
    is_accent, as_accent = detections["actual"] == ACCENT, detections["label"] == ACCENT
    rows = [
        _row(level, RECOGNITION, int((is_accent & as_accent).sum()), int(is_accent.sum())),
        _row(level, FALSE_ALARM, int((~is_accent & as_accent).sum()), int((~is_accent).sum())),
    ]
    return _table(detections[KEYS].iloc[0].tolist(), rows)


def accent_differences(detections: pd.DataFrame, settings: Settings, seed: int) -> Iterator[pd.DataFrame]:
    """Yield the differences between each two sets of features (schema ``direction_scores``).

    The intervals are from bootstrap samples of accents, or of other syllables, which both sets of features are tested
    on.

    Parameters
    ----------
    detections : those of all sets of features, with the same syllables in the same order; of one setting.
    """
    methods = list(dict.fromkeys(detections["method"]))
    own = {name: detections[detections["method"] == name].reset_index(drop=True) for name in methods}
    tail = (1.0 - settings.level) / 2.0
    is_accent = (own[methods[0]]["actual"] == ACCENT).to_numpy()
    for place, one in enumerate(methods):
        for other in methods[place + 1 :]:
            gain = (own[one]["label"] == ACCENT).to_numpy().astype(float) - (own[other]["label"] == ACCENT).to_numpy()
            rows: list[tuple[object, ...]] = []
            for measure, chosen in ((RECOGNITION, is_accent), (FALSE_ALARM, ~is_accent)):
                rng = random_source(seed, "accents", "bootstrap", one, other, measure)
                values = gain[chosen]
                kinds = np.array([np.count_nonzero(values == step) for step in (-1.0, 0.0, 1.0)])
                drawn = rng.multinomial(len(values), kinds / len(values), size=settings.samples) @ [-1.0, 0.0, 1.0]
                low, high = np.quantile(drawn / len(values), [tail, 1.0 - tail])
                rows.append((other, None, measure, None, len(values), float(values.mean()), low, high))
            yield _table(own[one][KEYS].iloc[0].tolist(), rows)

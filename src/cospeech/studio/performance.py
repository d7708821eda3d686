"""The motion of a scene in which arousal or syllables move the body (see ``worlds``).

In the world ``phrases``, ``motion`` performs the script. In the others, a hand is at a place, which is that of its
class of gestures as in ``choreography``, and beats around it. Arousal changes the rate of the beats, their size,
their height and how far their paths bend. Where subunits follow syllables, the strokes of head, arms and legs are
those of the plan, and a section is still between two of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats, Integers
from cospeech.data.rng import random_source
from cospeech.data.segments import at_times, frame_times
from cospeech.data.vocabulary import GESTURES
from cospeech.motion import head
from cospeech.motion.skeleton import JOINTS
from cospeech.studio import arousal, head_gestures, motion
from cospeech.studio.choreography import (
    AT_REST,
    FIGURES,
    LETS_GO,
    PREPARATION,
    REST,
    RETRACTION,
    SIDES,
    UNAWARE_S,
    Hand,
    Style,
    Track,
    minimum_jerk,
    phase_s,
    pose,
    style,
    turns,
)
from cospeech.studio.scenes import Scene

HEAD_DEG = {
    "front": (0.0, 0.0, 0.0),
    "down": (12.0, 0.0, 0.0),
    "left": (0.0, 16.0, 2.0),
    "right": (0.0, -16.0, -2.0),
    "tilted": (3.0, 0.0, 12.0),
}
"""Turn of the head about x, y and z in each of its subunits."""

HEAD_SPREAD_DEG = (1.5, 1.5, 1.5)

HIPS = {"centre": (0.0, 0.0, 0.0), "left": (0.06, 0.004, 10.0), "right": (-0.06, 0.004, -10.0)}
"""Displacement of the hips to the left and forward in metres, and their turn to the left in degrees, in each subunit
of the legs."""

SWAY = 0.2
"""Factor of the sway of an actor whose legs have subunits."""

HIPS_SPREAD = (0.004, 0.004, 1.0)

BEAT_SIZE = {"small": 0.6, "large": 1.5, "sideways": 0.5}
SIDEWAYS_M = 0.12
"""Size of beats relative to those of the choreography, and how far a sideways beat leads outward."""

STEP_S = 0.01
"""Time step at which the pace of arousal is integrated."""


class Beat(NamedTuple):
    """The beats of one hand as keyframes in warped time.

    Attributes
    ----------
    times_s : (K,) times of the keyframes.
    values : (K, 3) displacement of the hand from its place.
    arcs : (K, 3) direction in which the path that follows a keyframe deviates from a straight line.
    flows : (K,) 1 if the hand passes the keyframe on a round path without a stop, 0 if it stops there.
    """

    times_s: list[float]
    values: list[Floats]
    arcs: list[Floats]
    flows: list[float]

    def key(self, time_s: float, value: Floats, arc: Floats | None = None, flow: float = 0.0) -> None:
        """Add a keyframe; keyframes must be in temporal order, and a second one at the same time is ignored."""
        if not self.times_s or time_s > self.times_s[-1] + 1e-9:
            self.times_s.append(time_s)
            self.values.append(value)
            self.arcs.append(np.zeros(3) if arc is None else arc)
            self.flows.append(flow)

    def at(self, warped_s: Floats, size: Floats, arc_m: Floats) -> Floats:
        """Return the displacement (T, 3) at warped times (T,), with the size and the arc (T,) of each.

        Between two stops, the hand moves with minimum jerk; where it does not stop, on a half ellipse.
        """
        times_s, values, flows = np.array(self.times_s), np.array(self.values), np.array(self.flows)
        left = np.clip(np.searchsorted(times_s, warped_s, side="right") - 1, 0, max(len(times_s) - 2, 0))
        right = np.minimum(left + 1, len(times_s) - 1)
        u = np.clip((warped_s - times_s[left]) / np.maximum(times_s[right] - times_s[left], 1e-9), 0.0, 1.0)
        round_ = np.maximum(flows[left], flows[right])[:, None]
        even = values[left] + (0.5 - 0.5 * np.cos(np.pi * u))[:, None] * (values[right] - values[left])
        straight = (1.0 - round_) * minimum_jerk(times_s, values, warped_s) + round_ * even
        passing = flows[left] + (flows[right] - flows[left]) * u
        bend = np.sin(np.pi * u) * (passing + (1.0 - passing) * np.sin(np.pi * u))
        return np.asarray(size[:, None] * straight + (arc_m * bend)[:, None] * np.array(self.arcs)[left])


def perform(actor: str, record: str, scene: Scene, fps: float, seed: int) -> pd.DataFrame:
    """Return the noise-free motion table of one record.

    Parameters
    ----------
    scene : the scene of the record. Without arousal and subunits, ``motion`` performs its script.
    fps : frame rate of the motion.
    """
    body = _body(actor, record, scene, fps, seed)
    return body if scene.heads is None else head.moved(body, head.table(head_angles(actor, scene, fps, seed), fps))


def head_angles(actor: str, scene: Scene, fps: float, seed: int) -> Floats:
    """Return the angles of the head relative to the trunk, (T, 3) in degrees, in a scene with head gestures.

    Where the head also has subunits, which follow syllables, both are added.
    """
    assert scene.heads is not None
    times_s = frame_times(round(float(scene.heads["end_s"].iloc[-1]) * fps), fps)
    angles = head_gestures.perform(head_gestures.habits(actor, seed), scene.heads, times_s, seed)
    if scene.subunits is not None:
        rows = scene.subunits[scene.subunits["section"] == "head"]
        rng = random_source(seed, "head subunits", str(rows["record"].iloc[0]))
        angles += _poses(rows, HEAD_DEG, HEAD_SPREAD_DEG, times_s, rng)
    return angles


def _body(actor: str, record: str, scene: Scene, fps: float, seed: int) -> pd.DataFrame:
    """Return the motion table of one record without head gestures."""
    if scene.shown is None and scene.subunits is None:
        return motion.perform(actor, record, scene.gestures, scene.prosody, fps, seed)
    rng = random_source(seed, "motion", record)
    manner = style(actor, seed)
    times_s = frame_times(round(float(scene.gestures["end_s"].iloc[-1]) * fps), fps)
    sections = {} if scene.subunits is None else dict(list(scene.subunits.groupby("section")))
    moving = hands(scene, sections.get("arms"), manner, times_s, rng)
    degrees = dict.fromkeys(JOINTS, np.zeros((len(times_s), 3)))
    degrees |= motion.trunk(times_s, moving, _head(sections.get("head"), times_s), manner, rng)
    for side, values in zip(SIDES, moving, strict=True):
        degrees |= motion.arm(side, values, times_s, rng)
    root_m = motion.standing(times_s, rng)
    if "legs" in sections:
        aside, ahead, turn = _poses(sections["legs"], HIPS, HIPS_SPREAD, times_s, rng).T
        still = np.zeros(len(times_s))
        root_m = SWAY * root_m + np.column_stack([aside, still - (1.0 - SWAY) * motion.KNEES_SOFT_M, ahead])
        degrees["hips"] = degrees["hips"] + np.column_stack([still, turn, still])
    return motion.table(degrees, root_m, fps)


def hands(
    scene: Scene, arms: pd.DataFrame | None, manner: Style, times_s: Floats, rng: np.random.Generator
) -> list[Floats]:
    """Return the values (T, 8) of the left and the right hand (see ``choreography.Track``).

    Parameters
    ----------
    arms : the subunits of the arms, None if there are none.
    """
    if arms is not None and arms["subunit"].isin(GESTURES).all():
        return [track.at(times_s) for track in _forms(arms, manner, rng)]
    places, rates = (Track(), Track()), _Pace(scene.shown, float(times_s[-1]) + 1.0)
    beats = tuple(Beat([], [], [], []) for _ in SIDES)
    warp: list[tuple[float, float]] = []
    strokes = [] if arms is None else _strokes(arms, scene.gestures)
    for phrase in _phrases(scene.gestures, manner, rng):
        if phrase.label == "rest":
            for track in places:
                _rest(track, (phrase.start_s, phrase.end_s), manner, rng)
        else:
            _gesture(phrase, places, manner, rng)
            if arms is None:
                warp.append((phrase.begin_s, phrase.stop_s))
                _beat(phrase, beats, rates, manner, rng)
    for stroke in strokes:
        _beat_on_syllable(stroke, beats, manner)
    warped_s = rates.warped(times_s, warp)
    effects = (arousal.SIZE, arousal.REACH, arousal.ARC_M, arousal.FIDGET_M)
    size, way, arc_m, fidget_m = (arousal.eased(scene.shown, effect, times_s) for effect in effects)
    moving = []
    for track, beat in zip(places, beats, strict=True):
        values = track.at(times_s)
        active, values = values[:, 8], values[:, :8]
        values[:, :3] += (active * (way - 1.0))[:, None] * (values[:, :3] - REST)
        if beat.times_s:
            values[:, :3] += active[:, None] * beat.at(warped_s, size, arc_m)
        if scene.shown is not None:
            values[:, :3] += ((1.0 - active) * fidget_m)[:, None] * _fidgets(times_s, rng)
        moving.append(values)
    return moving


class _Phrase(NamedTuple):
    """A gesture phrase, the start and the end of its beats, and its hands; ``following`` is the next class."""

    label: str
    start_s: float
    end_s: float
    following: str | None
    begin_s: float
    stop_s: float
    figure: tuple[Hand, Hand]


def _figure(label: str, manner: Style) -> tuple[Hand, Hand]:
    figure = FIGURES[label]
    return figure[::-1] if label == "perpendicular" and manner.right_handed else figure


def _phrases(gestures: pd.DataFrame, manner: Style, rng: np.random.Generator) -> Iterator[_Phrase]:
    """Yield the gesture phrases of a record, with the random times between which their beats lie."""
    labels = gestures["label"].tolist()
    for label, following, start, end in zip(
        labels, [*labels[1:], None], gestures["start_s"], gestures["end_s"], strict=True
    ):
        last = max(end, start + UNAWARE_S) if following is None and label != "rest" else float(end)
        begin = start + phase_s(PREPARATION, last - start) * rng.uniform(0.85, 1.15)
        leave = phase_s(RETRACTION if following == "rest" else LETS_GO, last - start) * rng.uniform(0.85, 1.15)
        stop = last if following is None else last - leave
        yield _Phrase(label, float(start), last, following, begin, stop, _figure(label, manner))


def _rest(track: Track, times_s: tuple[float, ...], manner: Style, rng: np.random.Generator) -> None:
    value = np.append(pose(AT_REST, manner, rng, 0.3), 0.0)
    for time_s in times_s:
        track.key(time_s, value)


def _gesture(phrase: _Phrase, places: tuple[Track, Track], manner: Style, rng: np.random.Generator) -> None:
    """Add the places of both hands in one phrase, without beats; the last value is 1 where the hand gestures."""
    common = rng.normal(0.0, 0.04, 3)
    for track, hand in zip(places, phrase.figure, strict=True):
        if not track.times_s:
            _rest(track, (phrase.start_s,), manner, rng)
        gesturing = hand is not AT_REST
        base = pose(hand, manner, rng, 0.4, common) if gesturing else pose(hand, manner, rng, 0.3)
        for time_s in (phrase.begin_s, phrase.stop_s):
            track.key(time_s, np.append(base, float(gesturing)))
        if phrase.following == "rest":
            _rest(track, (phrase.end_s,), manner, rng)


class _Pace:
    """The pace of arousal over time, and time that is warped by it."""

    def __init__(self, shown: pd.DataFrame | None, end_s: float) -> None:
        self._grid_s = np.arange(0.0, end_s + UNAWARE_S + STEP_S, STEP_S)
        pace = arousal.eased(shown, arousal.PACE, self._grid_s)
        self._run = np.append(0.0, np.cumsum((pace[1:] + pace[:-1]) / 2)) * STEP_S

    def mean(self, begin_s: float, stop_s: float) -> float:
        """Return the mean pace between two times."""
        first, last = np.interp([begin_s, stop_s], self._grid_s, self._run)
        return float((last - first) / (stop_s - begin_s))

    def warped(self, times_s: Floats, spans: list[tuple[float, float]]) -> Floats:
        """Return times (T,) that run at the pace of arousal within each span, and in step outside of them."""
        warped_s = times_s.copy()
        run = np.interp(times_s, self._grid_s, self._run)
        for begin_s, stop_s in spans:
            first, last = np.searchsorted(times_s, [begin_s, stop_s])
            start, end = np.interp([begin_s, stop_s], self._grid_s, self._run)
            warped_s[first:last] = begin_s + (stop_s - begin_s) * (run[first:last] - start) / (end - start)
        return warped_s


def _beat(phrase: _Phrase, beats: tuple[Beat, ...], rates: _Pace, manner: Style, rng: np.random.Generator) -> None:
    """Add the beats of one phrase at the actor's own pace; arousal makes them more, and warps their times."""
    pace = rates.mean(phrase.begin_s, phrase.stop_s)
    turning_s = turns(phrase.begin_s, phrase.stop_s, replace(manner, beat_s=manner.beat_s / pace), rng)
    size = manner.size * rng.lognormal(0.0, 0.1)
    for beat, hand in zip(beats, phrase.figure, strict=True):
        if hand is AT_REST:
            continue
        late_s = turning_s.copy()
        late_s[1:-1] += hand.lag * (turning_s[2:] - turning_s[1:-1])
        away = size * np.array(hand.beat)
        arc = _across(away)
        for turn, time_s in enumerate(late_s.tolist()):
            last = turn == len(late_s) - 1
            side = 0.0 if last else 1.0 - 2.0 * (turn % 2)
            beat.key(time_s, away * (turn % 2), side * arc, float(turn > 0 and not last))
        if phrase.following == "rest":
            beat.key(phrase.end_s, np.zeros(3))


def _fidgets(times_s: Floats, rng: np.random.Generator) -> Floats:
    """Return small movements (T, 3) of one hand at rest, of about unit size, upward and forward of its place."""
    up, forward = (0.5 + 0.4 * motion.wander(times_s, 0.8, 1.6, rng) for _ in range(2))
    return np.column_stack([np.zeros(len(times_s)), np.maximum(up, 0.0), forward])


def _across(away: Floats) -> Floats:
    """Return the unit vector across a beat and forward or outward, in which its path bends."""
    for axis in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)):
        across = np.cross(away, axis)
        if np.linalg.norm(across) > 0.5 * np.linalg.norm(away):
            return np.asarray(across / np.linalg.norm(across))
    return np.zeros(3)


class _Stroke(NamedTuple):
    """A subunit of the arms as a beat: its start and end, its kind, and the class of gestures at its end."""

    start_s: float
    end_s: float
    kind: str
    label: str


def _strokes(arms: pd.DataFrame, gestures: pd.DataFrame) -> list[_Stroke]:
    rows: Integers = at_times(gestures, arms["stroke_end_s"].to_numpy())
    labels = gestures["label"].to_numpy(dtype=object)[rows]
    return [
        _Stroke(float(start), float(end), kind, label)
        for start, end, kind, label in zip(
            arms["start_s"], arms["stroke_end_s"], arms["subunit"], labels, strict=True
        )
    ]


def _beat_on_syllable(stroke: _Stroke, beats: tuple[Beat, ...], manner: Style) -> None:
    """Add one stroke: from the place of the hand to the end of a beat, or back."""
    for beat, hand in zip(beats, _figure(stroke.label, manner), strict=True):
        current = beat.values[-1] if beat.values else np.zeros(3)
        away = manner.size * np.array(hand.beat)
        target = current
        if stroke.kind != "hold":
            out = BEAT_SIZE[stroke.kind] * away
            if stroke.kind == "sideways" and hand is not AT_REST:
                out[0] += SIDEWAYS_M
            target = np.zeros(3) if current.any() else out
        beat.key(stroke.start_s, current, _across(target - current))
        beat.key(stroke.end_s, target)


def _forms(arms: pd.DataFrame, manner: Style, rng: np.random.Generator) -> tuple[Track, Track]:
    """Return the keyframes of both hands for subunits that are classes of gestures.

    A subunit of the same kind as the one before is a beat from its place, or back.
    """
    tracks = (Track(), Track())
    previous, turn = None, 0
    for label, start, end in zip(arms["subunit"], arms["start_s"], arms["stroke_end_s"], strict=True):
        turn = turn + 1 if label == previous else 0
        previous = label
        common = rng.normal(0.0, 0.04, 3)
        for track, hand in zip(tracks, _figure(label, manner), strict=True):
            gesturing = hand is not AT_REST
            target = pose(hand, manner, rng, 0.4, common) if gesturing else pose(hand, manner, rng, 0.3)
            target[:3] += (turn % 2) * manner.size * np.array(hand.beat)
            track.key(start, track.values[-1] if track.values else pose(AT_REST, manner, rng, 0.3))
            track.key(end, target)
    return tracks


def _poses(
    table: pd.DataFrame,
    poses: Mapping[str, tuple[float, ...]],
    spread: tuple[float, ...],
    times_s: Floats,
    rng: np.random.Generator,
) -> Floats:
    """Return the course (T, C) of a section that moves to a pose, with some variation, in each of its subunits."""
    keys_s: list[float] = []
    values: list[Floats] = []
    for kind, start, end in zip(table["subunit"], table["start_s"], table["stroke_end_s"], strict=True):
        target = np.array(poses[kind])
        target += rng.normal(0.0, spread, len(target))
        keys_s += [start, end]
        values += [values[-1] if values else target, target]
    return minimum_jerk(np.array(keys_s), np.array(values), times_s)


def _head(table: pd.DataFrame | None, times_s: Floats) -> Callable[[np.random.Generator], Floats]:
    """Return a function that returns the turn of the head (T, 3) in degrees."""

    def turn(rng: np.random.Generator) -> Floats:
        if table is None:
            return np.zeros((len(times_s), 3))
        return _poses(table, HEAD_DEG, HEAD_SPREAD_DEG, times_s, rng)

    return turn

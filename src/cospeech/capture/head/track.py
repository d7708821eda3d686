"""From the film of a head, in stereo or from one camera, to its pose in every frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from cospeech.capture.head import optics as camera_optics
from cospeech.capture.head import shape
from cospeech.capture.head.estimate import MISSING, Measurement
from cospeech.capture.head.face import Box
from cospeech.capture.head.images import Frame, Planes
from cospeech.capture.head.optics import Optics
from cospeech.capture.head.pose import RigidFit
from cospeech.capture.head.printed_flow import Increments
from cospeech.capture.head.smoothing import Smoothing, pose_table
from cospeech.capture.head.tracker import Flow, Method, Tracker, find_face
from cospeech.capture.tracking import footage
from cospeech.capture.tracking.footage import Film
from cospeech.errors import UserError
from cospeech.geometry.camera import Camera

FACE_WITHIN_S = 10.0
"""How long a film may go on before it shows a face."""

LOOK_EVERY = 3
"""Every how many frames a face is searched before the first is found."""

MOST_LOST = 0.5
"""Share of lost frames above which a film is refused."""


class Tracked(NamedTuple):
    """The head of one film: the table ``head_pose``, and what a person should know about it, one line each."""

    table: pd.DataFrame
    notes: list[str]


def track(
    films: Sequence[Film], cameras: Sequence[Camera], settings: dict[str, Any], most_frames_apart: int, where: str
) -> Tracked:
    """Return the pose of the head in a film, relative to the first frame in which its face is found.

    Parameters
    ----------
    films, cameras : two films and the cameras of a rectified pair in the same order, whichever is left; or one film
        and its camera, which then needs no place.
    settings : the section ``capture.head`` of the configuration.
    most_frames_apart : largest difference in length between the two films, frames.
    where : name of the record, for messages.

    Raises
    ------
    UserError : if the films do not fit the cameras or each other, show no face, or two, or lose it in most frames.
    """
    n_frames = footage.check(films, cameras, most_frames_apart)
    if len(films) == 1:
        optics, left = camera_optics.single(cameras[0]), 0
        if settings["flow"] == Flow.PRINTED.value:
            raise UserError(
                f"{where}: capture.head.flow: 'printed' needs a stereo pair; choose 'warped' for one film"
            )
    else:
        optics, left = camera_optics.rectified(cameras)
    views = footage.read([films[left], *films[:left], *films[left + 1 :]], n_frames)
    return track_images(views, optics, settings, films[left].fps, where)


def track_images(
    views: Iterator[Sequence[Planes]], optics: Optics, settings: dict[str, Any], fps: float, where: str
) -> Tracked:
    """Return the pose of the head in a sequence of images; see ``track``.

    Parameters
    ----------
    views : for each frame the planes Y, Cb, Cr of the left image, and those of the right one if there are two.
    optics : of the left camera.
    """
    chosen, width = method(settings), optics.size_px[0]
    if optics.baseline_m is None and chosen.flow is Flow.PRINTED:
        raise UserError(f"{where}: capture.head.flow: 'printed' needs a stereo pair; choose 'warped' for one film")
    tracker: Tracker | None = None
    measured: list[Measurement] = []
    for number, planes in enumerate(views):
        left, *others = (tuple(np.ascontiguousarray(plane[:, :width]) for plane in view) for view in planes)
        frame = Frame(number, (left[0], left[1], left[2]), others[0][0] if others else None)
        if tracker is None and (face := _look(frame, fps, where)):
            tracker = Tracker(frame, face, optics, chosen, where)
        measured.append(tracker.step(frame) if tracker else MISSING)
    if tracker is None:
        raise UserError(_no_face(where, len(measured), fps))
    centre_m = tracker.estimator.reference.centre_m
    if optics.baseline_m is None:
        measured = shape.measured_again(measured, tracker.estimator)
    table = pose_table(measured, centre_m, fps, Smoothing(settings["smoothing"]), settings["longest_hidden_s"])
    table["depth"] = "ellipsoid" if optics.baseline_m is None else "disparity"
    return Tracked(table, _notes(table, tracker.losses, where) + _dark(tracker.right_dark, fps, where))


def lost(n_frames: int, fps: float) -> pd.DataFrame:
    """Return the table of a film of ``n_frames`` frames in which nothing could be measured."""
    return pose_table([MISSING] * n_frames, np.zeros(3), fps, Smoothing.NONE, 0.0)


def method(settings: dict[str, Any]) -> Method:
    """Return the choices of the section ``capture.head`` that concern single frames."""
    return Method(
        Flow(settings["flow"]),
        RigidFit(settings["rigid"]),
        Increments(settings["increments"]),
        settings["head_width_m"],
    )


def _look(frame: Frame, fps: float, where: str) -> Box | None:
    """Return the face in a frame, if the first is still searched in it."""
    if frame.number > FACE_WITHIN_S * fps:
        raise UserError(_no_face(where, frame.number, fps))
    return find_face(frame, where) if frame.number % LOOK_EVERY == 0 else None


def _no_face(where: str, n_frames: int, fps: float) -> str:
    return (
        f"{where}: no face in frames 0 to {n_frames - 1} ({n_frames / fps:.1f} s); the film must begin with a person "
        "who looks into the camera, with a face at least an eighth of the image wide"
    )


def _dark(frames: Sequence[int], fps: float, where: str) -> list[str]:
    """Return what to say about frames whose right image is dark."""
    if not frames:
        return []
    return [
        f"{where}: the right film is dark in {len(frames)} frames, the first of them frame {frames[0]} "
        f"({(frames[0] + 0.5) / fps:.2f} s); only the left film was measured there"
    ]


def _notes(table: pd.DataFrame, losses: Mapping[int, str], where: str) -> list[str]:
    """Return what to say about frames without a measurement, given why those of ``losses`` have none.

    Raises
    ------
    UserError : if the head is lost in most frames.
    """
    if not losses:
        return []
    unseen, lost = int((table["status"] != "tracked").sum()), int((table["status"] == "lost").sum())
    first = min(losses)
    said = (
        f"{where}: {unseen} of {len(table)} frames not measured, {lost} of them lost; the first is frame "
        f"{first} ({table['time_s'].iloc[first]:.2f} s), {losses[first]}"
    )
    if lost > MOST_LOST * len(table):
        raise UserError(f"{said}; film the face sharper, in better light, at a higher frame rate and unobstructed")
    return [said]

"""Tracking quality for manual review: when each marker was not detected, and the worst moments."""

from __future__ import annotations

import numpy as np
import pandas as pd

from cospeech.motion.markers import NAMES

UNSEEN = ("predicted", "lost")


def spans(world: pd.DataFrame) -> pd.DataFrame:
    """Return the spans in which markers were not detected (schema ``marker_spans``), from a table ``markers_3d``."""
    rows = []
    frame_s = 2.0 * float(world["time_s"].iloc[0])
    for marker in NAMES:
        status = world.loc[world["marker"] == marker, "status"].to_numpy()
        starts = np.flatnonzero(np.r_[True, status[1:] != status[:-1]])
        for first, end in zip(starts, np.r_[starts[1:], len(status)], strict=True):
            if status[first] in UNSEEN:
                rows.append((marker, status[first], first, end, (end - first) * frame_s))
    return pd.DataFrame(rows, columns=["marker", "status", "first_frame", "end_frame", "duration_s"]).astype(
        {"marker": str, "status": str, "first_frame": int, "end_frame": int, "duration_s": float}
    )


def worst_moments(world: pd.DataFrame, count: int, apart_s: float = 1.0) -> pd.DataFrame:
    """Return the ``count`` worst moments as rows frame, time_s, marker, status, residual_px.

    Lost markers come first, then predicted ones, then the largest residuals. Two moments of the same marker are at
    least ``apart_s`` seconds apart.
    """
    rank = world["status"].map({"lost": 2, "predicted": 1}).fillna(0).to_numpy()
    order = world.assign(rank=rank).sort_values(
        ["rank", "residual_px", "frame"], ascending=[False, False, True], kind="stable"
    )
    chosen: list[int] = []
    seen: dict[str, list[float]] = {marker: [] for marker in NAMES}
    for index, time_s, marker in order[["time_s", "marker"]].itertuples():
        if all(abs(time_s - other) >= apart_s for other in seen[marker]):
            seen[marker].append(time_s)
            chosen.append(index)
        if len(chosen) == count:
            break
    return world.loc[chosen, ["frame", "time_s", "marker", "status", "residual_px"]].reset_index(drop=True)


def nearest_known(views: pd.DataFrame) -> pd.DataFrame:
    """Return a table ``markers_2d`` in which a lost marker has its last known position, or else the next one."""
    ordered = views.sort_values("frame", kind="stable")
    who = [ordered["camera"], ordered["marker"]]
    places = ordered[["x_px", "y_px"]].groupby(who).ffill().groupby(who).bfill()
    return views.assign(x_px=places["x_px"], y_px=places["y_px"])


def in_views(moments: pd.DataFrame, views: pd.DataFrame) -> pd.DataFrame:
    """Return the result of ``worst_moments`` with the positions in every view (schema ``worst_moments``).

    Parameters
    ----------
    views : the table ``markers_2d``.
    """
    known = nearest_known(views).rename(columns={"status": "view_status"}).drop(columns="n_pixels")
    ranked = moments.assign(moment=np.arange(1, len(moments) + 1))
    found = ranked.merge(known, on=["frame", "marker"]).sort_values(["moment", "camera"], ignore_index=True)
    return found[["moment", *moments.columns, "camera", "view_status", "x_px", "y_px"]]


def summary(world: pd.DataFrame) -> list[str]:
    """Return one line per marker: the percentage of frames in each status, and the RMS residual."""
    lines = []
    for marker in NAMES:
        rows = world[world["marker"] == marker]
        share = rows["status"].value_counts(normalize=True)
        residual = np.sqrt(np.mean(np.square(rows["residual_px"].dropna().to_numpy())))
        parts = [f"{name} {100 * share.get(name, 0.0):.1f} %" for name in ("seen", "corrected", "predicted", "lost")]
        lines.append(f"{marker}: {', '.join(parts)}, residual {residual:.2f} px RMS")
    return lines

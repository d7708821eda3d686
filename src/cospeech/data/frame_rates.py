"""Frame rates behind the rounded numbers in motion and marker files.

Many programs write the frame time with three or four decimals. Taken literally, 0.017 s would be 58.82 frames per
second, and motion and speech would drift apart by 2 %; it is 1/60 s. A rounded frame time is therefore taken for that
of the common rate that it was rounded (or truncated) from. If rates fit that differ by more than that of television
from its whole number (29.97 and 30), the file does not determine its rate.
"""

from __future__ import annotations

from decimal import Decimal, InvalidOperation

import numpy as np

from cospeech.errors import UserError

NTSC = (23.976, 29.97, 47.952, 59.94, 119.88, 239.76)
"""Frame rates of television, as they are usually written: N * 1000 / 1001."""

COMMON = (
    10.0, 12.0, 12.5, 15.0, 20.0, 24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 72.0, 75.0, 80.0, 90.0, 100.0, 120.0, 144.0,
    150.0, 180.0, 200.0, 240.0, 300.0, 360.0, 480.0, 500.0, 1000.0, *NTSC,
)  # fmt: skip
"""Frame rates of cameras, capture systems and animation programs."""

EXACT = 1e-4
"""A rate within this relative distance of a whole or a common one is that one, such as 1/0.033333."""

SAME = 2e-3
"""Relative distance within which two rates count as one: that of 29.97 and 30, doubled."""

TRUNCATED = {float(int(rate)): rate for rate in NTSC if rate != 47.952}
"""Rates of television without their decimals: no device records 29 frames per second."""


def from_frame_time(text: str, where: str) -> tuple[float, list[str]]:
    """Return the frame rate of a frame time in seconds as written in a file, and notes on how it was interpreted.

    Raises
    ------
    UserError : if it is not a number of seconds, or if several common rates fit it.
    """
    try:
        given = Decimal(text.strip())
        seconds = float(given)
    except (InvalidOperation, ValueError):  # signalling NaN raises the latter
        advice = "a decimal point" if "," in text else "seconds per frame, such as 0.05"
        raise UserError(f"{where}: the frame time '{text.strip()[:20]}' is not a number; write {advice}") from None
    if not 0.001 <= seconds <= 1.0:
        raise UserError(f"{where}: a frame time of {text.strip()[:20]} s; write seconds per frame, such as 0.05")
    exact = _near(1 / seconds)
    # Zeros at the end confirm a whole rate (0.0080), but not one that nobody uses (0.0170).
    step = _last_digit(given if exact is not None or _is_half(1 / seconds) else given.normalize())
    fitting = [rate for rate in COMMON if abs(1 / rate - seconds) < 0.5 * step * (1 - 1e-6)]
    fitting = fitting or [rate for rate in COMMON if 0 < 1 / rate - seconds < step * (1 - 1e-6)]
    if exact is not None and (exact in COMMON or not fitting):
        return exact, []
    literal = [] if exact is None and not _is_half(1 / seconds) else [1 / seconds]
    if not fitting:
        uncertain = 0.5 * step / seconds
        coarse = f"frame time {text.strip()} s has few digits: its frame rate may be off by {100 * uncertain:.1f} %"
        return 1 / seconds, [coarse] if uncertain > SAME / 2 else []
    if max(fitting + literal) / min(fitting + literal) > 1 + SAME:
        rates = " and ".join(f"{rate:g}" for rate in sorted({*literal, *_whole(fitting)}))
        raise UserError(f"{where}: {rates} frames/s fit a frame time of {text.strip()} s; write it with 7 decimals")
    rate = _whole(fitting)[-1]
    others = "".join(f"; {other:g} fits as well" for other in fitting if other != rate)
    return rate, [f"frame time {text.strip()} s, rounded in the file, taken as {rate:g} frames/s{others}"]


def from_rate(fps: float) -> tuple[float, list[str]]:
    """Return the frame rate of a number of frames per second in a file, and notes on how it was interpreted.

    The rates of television are often written in single precision or without their decimals.
    """
    if fps in TRUNCATED:
        return TRUNCATED[fps], [f"frame rate {fps:g}, truncated in the file, taken as {TRUNCATED[fps]:g} frames/s"]
    near = _near(fps, 2 * EXACT)  # 23.98
    return fps if near is None else near, []


def _near(fps: float, tolerance: float = EXACT) -> float | None:
    """Return the whole or common rate that ``fps`` is, but for rounding."""
    nearest = min([*COMMON, float(round(fps))], key=lambda rate: abs(rate - fps))
    return nearest if abs(nearest / fps - 1) < tolerance else None


def _is_half(fps: float) -> bool:
    return abs(2 * fps - round(2 * fps)) < EXACT


def _whole(rates: list[float]) -> list[float]:
    """Return ``rates`` in ascending order without those of television whose whole number is among them."""
    return sorted(rate for rate in rates if not any(1 < other / rate < 1 + SAME for other in rates))


def _last_digit(number: Decimal) -> float:
    """Return the value of one unit of the last digit."""
    exponent = number.as_tuple().exponent
    assert isinstance(exponent, int)  # infinite numbers were rejected
    return float(np.float64(10.0) ** exponent)

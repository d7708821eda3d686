"""Features of voice and lips from films, for the commands that need them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cospeech.commands.messages import note
from cospeech.errors import UserError

if TYPE_CHECKING:
    import pandas as pd

    from cospeech.identity.features import Features


def of_sheet(sheet: Path) -> Features:
    """Return the features of the films in a sheet; one that cannot be used is reported and left out.

    Raises
    ------
    UserError : if the sheet cannot be read, or no film can be used.
    """
    from cospeech.corpus import clips

    found = clips.read(sheet)
    for line in found.notes:
        note(line)
    stated = {one["clip"]: (one["x_px"], one["y_px"]) for one in found.mouths.to_dict("records")}
    return _measured(found.clips, stated, keep_going=True)


def of_films(films: list[Path], mouth: tuple[float, float] | None = None) -> Features:
    """Return the features of films whose speaker is not known.

    Parameters
    ----------
    films : the files, with sound.
    mouth : centre of the mouth in the first frame, in pixels; by default it is looked for.

    Raises
    ------
    UserError : if a film cannot be used.
    """
    import pandas as pd

    from cospeech.corpus import clips

    rows = []
    for number, film in enumerate(films):
        facts = clips.look_at(film)
        if not facts.has_sound:
            raise UserError(f"{film}: has no sound; give a film of a speaking face with its sound")
        rows.append(
            {"clip": f"clip{number}", "speaker": None, "phrase": "unknown", "repetition": 0, "session": None,
             "own_name": False, "film": str(film), "sound": str(film), "fps": facts.fps,
             "duration_s": facts.duration_s, "delay_planted_s": None}
        )  # fmt: skip
    table = pd.DataFrame(rows)
    return _measured(table, {} if mouth is None else dict.fromkeys(table["clip"], mouth), keep_going=False)


def _measured(clips: pd.DataFrame, mouths: dict[str, tuple[float, float]], keep_going: bool) -> Features:
    from cospeech.formats import audio, sound
    from cospeech.identity import features
    from cospeech.identity.lips import features as lips
    from cospeech.speech import mfcc

    heard, seen = [], []
    for clip in clips.to_dict("records"):
        name = clip["clip"]
        try:
            voice = mfcc.coefficients(audio.read(clip["sound"]).samples, sound.RATE_HZ)
            seen.append(lips.measure(name, clip["film"], clip["fps"], mouths.get(name)))
            heard.append(mfcc.table(name, voice))
        except UserError as error:
            if not keep_going:
                raise
            note(f"{clip['film']} is left out: {error}")
    if not heard:
        raise UserError("no film can be used; the lines above say why")
    return features.of_lists([clips], heard, seen)

"""ELAN annotation files (.eaf): times in whole milliseconds, one tier of spans for each name."""

from __future__ import annotations

from pathlib import Path

from pympi import Elan

from cospeech.data import tables
from cospeech.errors import UserError

Spans = list[tuple[float, float, str]]

WRITTEN = "2012-01-01T00:00:00+00:00"
"""The date that every file carries: the format demands one, and equal contents are to be equal files."""


def read(path: str | Path) -> dict[str, Spans]:
    """Return the spans (start, end, label) of every tier, in seconds; NaN where one is tied to no time.

    Raises
    ------
    UserError : where the file is no readable EAF.
    """
    try:
        document = Elan.Eaf(path, suppress_version_warning=True)
        tiers = {name: document.get_annotation_data_for_tier(name) for name in document.get_tier_names()}
        return {name: [(row[0] / 1000, row[1] / 1000, row[2] or "") for row in rows] for name, rows in tiers.items()}
    except Exception as error:  # what a damaged file raises inside the library is anybody's guess
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: damaged, or no ELAN file ({reason}); save it again in ELAN") from error


def _seconds(time_ms: int | None) -> float:
    return float("nan") if time_ms is None else time_ms / 1000


def write(path: str | Path, tier: str, spans: Spans, labels: list[str], media: str | None) -> None:
    """Write spans as one tier, their labels to be chosen from a list.

    Parameters
    ----------
    path : the .eaf file.
    tier : name of the tier.
    spans : (start, end, label) in seconds, in order; those shorter than half a millisecond vanish.
    labels : the values that ELAN offers.
    media : the sound, relative to the file's folder; None where there is none.
    """
    document = Elan.Eaf(author="cospeech")
    document.adocument["DATE"] = WRITTEN
    document.header = {"MEDIA_FILE": "", "TIME_UNITS": "milliseconds"}
    if media is not None:
        document.add_linked_file(media, relpath=media, mimetype="audio/x-wav")
    document.add_language("und", "http://cdb.iso.org/lg/CDB-00130975-001", "undetermined (und)")
    document.add_controlled_vocabulary("gestures")
    document.add_cv_description("gestures", "und", "gesture classes")
    for number, label in enumerate(labels):
        document.add_cv_entry("gestures", f"gesture_{number}", [(label, "und", None)])
    document.add_linguistic_type("gesture", graphicreferences=False, timealignable=True)
    document.linguistic_types["gesture"]["CONTROLLED_VOCABULARY_REF"] = "gestures"
    document.remove_tier("default")
    document.remove_linguistic_type("default-lt")
    document.add_tier(tier, ling="gesture")
    for start, end, label in spans:
        first, last = round(start * 1000), round(end * 1000)
        if first < last:
            document.add_annotation(tier, first, last, label)
    document.properties = [("lastUsedAnnotationId", document.maxaid)]
    text = Elan.to_string(document, pretty=True, encoding="unicode")
    with tables.replacing(path) as temporary:
        temporary.write_text(f'<?xml version="1.0" encoding="UTF-8"?>\n{text}', encoding="utf-8", newline="\n")

"""ELAN annotation files (.eaf): tiers of labelled intervals, with times in whole milliseconds."""

from __future__ import annotations

from pathlib import Path

from pympi import Elan

from cospeech.data import tables
from cospeech.data.segments import Spans
from cospeech.errors import UserError

WRITTEN = "2012-01-01T00:00:00+00:00"
"""The date in every file: the format requires one, and equal contents should give equal files."""


def read(path: str | Path) -> dict[str, Spans]:
    """Return the spans (start, end, label) of every tier, in seconds.

    Raises
    ------
    UserError : if the file is not a readable EAF file.
    """
    try:
        document = Elan.Eaf(path, suppress_version_warning=True)
        tiers = {name: document.get_annotation_data_for_tier(name) for name in document.get_tier_names()}
        return {name: [(row[0] / 1000, row[1] / 1000, row[2] or "") for row in rows] for name, rows in tiers.items()}
    except Exception as error:  # damaged files make the library raise all kinds of errors
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: damaged, or not an ELAN file ({reason}); save it again in ELAN") from error


def write(path: str | Path, tier: str, spans: Spans, labels: list[str], media: str | None) -> None:
    """Write spans as one tier whose labels are chosen from a list.

    Parameters
    ----------
    path : the .eaf file.
    tier : name of the tier.
    spans : (start, end, label) in seconds, in order; those that round to 0 ms are dropped.
    labels : the labels that ELAN offers.
    media : sound file, relative to the folder of ``path``; None if there is none.
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

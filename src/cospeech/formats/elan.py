"""ELAN annotation files (.eaf): tiers of labelled intervals, with times in whole milliseconds."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote

from pympi import Elan

from cospeech.data import tables
from cospeech.data.segments import Spans
from cospeech.errors import UserError
from cospeech.formats import plain_text
from cospeech.formats.tiers import Interval

WRITTEN = "2012-01-01T00:00:00+00:00"
"""The date in every file: the format requires one, and equal contents should give equal files."""

MAX_DEPTH = 50
"""Number of levels of tiers beyond which a tier must be its own parent."""

WHOLE = re.compile(r"\s*-?\d{1,15}\s*", re.ASCII)


class Media(NamedTuple):
    """A linked film or sound: its file name, MIME type, and the time in it at which annotation times begin."""

    name: str
    mime_type: str
    origin_s: float


class Document:
    """The tiers of an EAF file. A tier is read when it is asked for, so that faults in other tiers do not matter.

    Parameters
    ----------
    path : the .eaf file.

    Attributes
    ----------
    tiers, labelled : names of the tiers, in the order of the file, and of those that have labels.
    media : the linked films and sounds.

    Raises
    ------
    UserError : if the file is not a readable EAF file, or counts time in frames.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = path
        self._root = _parse(path)
        header = self._root.find("HEADER")
        units = "milliseconds" if header is None else header.get("TIME_UNITS", "milliseconds")
        if units != "milliseconds":
            raise UserError(f"{path}: counts time in {units[:20]}, not in milliseconds; save it again in ELAN")
        self._tiers = self._root.findall("TIER")
        self.tiers = [tier.get("TIER_ID", "") for tier in self._tiers]
        self.labelled = [name for name, tier in zip(self.tiers, self._tiers, strict=True) if _has_labels(tier)]
        self.media = [self._media(descriptor) for descriptor in self._root.findall("HEADER/MEDIA_DESCRIPTOR")]
        slots = self._root.findall("TIME_ORDER/TIME_SLOT")
        self._order = {slot.get("TIME_SLOT_ID", ""): number for number, slot in enumerate(slots)}
        self._stated = {slot.get("TIME_SLOT_ID", ""): slot.get("TIME_VALUE") for slot in slots}
        self._placed: dict[str, float] = {}
        self._parts: dict[int, dict[str, list[ET.Element]]] = {}
        self._owners = {
            annotation.get("ANNOTATION_ID", ""): (tier, annotation)
            for tier in self._tiers
            for annotation in _annotations(tier)
        }

    def read_tier(self, name: str) -> tuple[list[Interval], bool]:
        """Return the labelled annotations of a tier, and whether boundaries without a time were placed evenly.

        ELAN leaves out the times of boundaries within an annotation of the parent tier until someone moves them, and
        shows them at even distances. Annotations that only refer to annotations of another tier have their times.

        Raises
        ------
        UserError : if the file has two tiers of this name, or an annotation with a label has no time.
        """
        (tier, *more) = [tier for tier in self._tiers if tier.get("TIER_ID", "") == name]
        if more:
            raise UserError(f"{self._path}: has two tiers called '{name}'; rename one of them")
        intervals, before = [], len(self._placed)
        for annotation in _annotations(tier):
            label = _label(annotation)
            if label:
                start_ms, end_ms = self._times_ms(tier, annotation, 0)
                place = f"annotation {annotation.get('ANNOTATION_ID')}"
                intervals.append(Interval(start_ms / 1000, end_ms / 1000, label, place))
        return intervals, len(self._placed) > before

    def _media(self, descriptor: ET.Element) -> Media:
        address = descriptor.get("MEDIA_URL") or descriptor.get("RELATIVE_MEDIA_URL") or ""
        name = unquote(re.split(r"[/\\]", address)[-1])
        stated = descriptor.get("TIME_ORIGIN") or "0"
        if not WHOLE.fullmatch(stated):
            raise UserError(
                f"{self._path}: TIME_ORIGIN of {name or 'its media'} is '{stated[:20]}', not a whole number of "
                "milliseconds; set the offset of the media in ELAN again"
            )
        return Media(name, descriptor.get("MIME_TYPE", ""), int(stated) / 1000)

    def _times_ms(self, tier: ET.Element, annotation: ET.Element, depth: int) -> tuple[float, float]:
        """Return the start and end of an annotation, which may refer to one of another tier."""
        if annotation.tag == "ALIGNABLE_ANNOTATION":
            slots = annotation.get("TIME_SLOT_REF1", ""), annotation.get("TIME_SLOT_REF2", "")
            if any(self._slot_ms(slot, tier) is None for slot in slots):
                self._place_evenly(tier, 0)
            start, end = (self._slot_ms(slot, tier) for slot in slots)
            if start is None or end is None:
                raise self._fault(tier, annotation, f"has no {'start' if start is None else 'end'} time")
            return start, end
        parent = annotation.get("ANNOTATION_REF", "")
        if parent not in self._owners:
            raise self._fault(tier, annotation, f"refers to annotation '{parent[:20]}', which does not exist")
        if depth > MAX_DEPTH:
            raise self._fault(tier, annotation, "refers to itself")
        start, end = self._times_ms(*self._owners[parent], depth + 1)
        parts = self._parts_of(tier)[parent]
        width, number = (end - start) / len(parts), parts.index(annotation)
        return start + number * width, start + (number + 1) * width

    def _parts_of(self, tier: ET.Element) -> dict[str, list[ET.Element]]:
        """Return the annotations of a tier by the annotation that they refer to, in their order."""
        if id(tier) not in self._parts:
            found: dict[str, list[ET.Element]] = {}
            for annotation in _annotations(tier):
                found.setdefault(annotation.get("ANNOTATION_REF", ""), []).append(annotation)
            self._parts[id(tier)] = {parent: _in_order(parts) for parent, parts in found.items()}
        return self._parts[id(tier)]

    def _slot_ms(self, slot: str, tier: ET.Element) -> float | None:
        if slot in self._placed:
            return self._placed[slot]
        if slot not in self._stated:
            raise UserError(
                f"{self._path}: tier '{tier.get('TIER_ID')}' refers to time slot '{slot[:20]}', which does not "
                "exist; save the file again in ELAN"
            )
        stated = self._stated[slot]
        if stated is None or stated == "-1":
            return None
        if not WHOLE.fullmatch(stated):
            raise UserError(
                f"{self._path}: time slot '{slot[:20]}' of tier '{tier.get('TIER_ID')}' has the time "
                f"'{stated[:20]}', not a whole number of milliseconds; correct it"
            )
        return float(stated)

    def _place_evenly(self, tier: ET.Element, depth: int) -> None:
        """Place the boundaries of a tier that have no time at even distances between those that have one."""
        parents = [other for other in self._tiers if other.get("TIER_ID") == tier.get("PARENT_REF")]
        if parents and depth < MAX_DEPTH:  # their boundaries may have no time either
            self._place_evenly(parents[0], depth + 1)
        run: list[tuple[str, str]] = []
        for first, last in sorted(
            (
                (annotation.get("TIME_SLOT_REF1", ""), annotation.get("TIME_SLOT_REF2", ""))
                for annotation in _annotations(tier)
                if annotation.tag == "ALIGNABLE_ANNOTATION"
            ),
            key=lambda slots: self._order.get(slots[0], -1),
        ):
            start, end = self._slot_ms(first, tier), self._slot_ms(last, tier)
            run = [(first, last)] if start is not None else [*run, (first, last)]
            if end is None:
                continue
            begin = self._slot_ms(run[0][0], tier)
            if len(run) > 1 and begin is not None:
                for number, ((_, before), (after, _)) in enumerate(pairwise(run), start=1):
                    self._placed[before] = self._placed[after] = begin + (end - begin) * number / len(run)
            run = []

    def _fault(self, tier: ET.Element, annotation: ET.Element, what: str) -> UserError:
        label, name = plain_text.shown(_label(annotation)), plain_text.shown(tier.get("TIER_ID", ""))
        return UserError(
            f"{self._path}: tier '{name}', annotation {annotation.get('ANNOTATION_ID')} ('{label}'): "
            f"{what}; correct it in ELAN"
        )


def _parse(path: str | Path) -> ET.Element:
    content = plain_text.read_bytes(path)
    try:
        root = ET.fromstring(content)
    except (ET.ParseError, ValueError, LookupError) as error:
        reason = " ".join(str(error).split())[:80]
        raise UserError(f"{path}: is not an ELAN file, as it is not XML ({reason}); save it again in ELAN") from error
    if root.tag != "ANNOTATION_DOCUMENT":
        raise UserError(
            f"{path}: is not an ELAN file (its root element is {root.tag[:40]}, not ANNOTATION_DOCUMENT); save it "
            "again in ELAN"
        )
    return root


def _annotations(tier: ET.Element) -> list[ET.Element]:
    inner = [child[0] for child in tier.findall("ANNOTATION") if len(child)]
    return [element for element in inner if element.tag in ("ALIGNABLE_ANNOTATION", "REF_ANNOTATION")]


def _label(annotation: ET.Element) -> str:
    return (annotation.findtext("ANNOTATION_VALUE") or "").strip()


def _has_labels(tier: ET.Element) -> bool:
    return any(_label(annotation) for annotation in _annotations(tier))


def _in_order(siblings: list[ET.Element]) -> list[ET.Element]:
    """Return the parts of one annotation, each of which names the previous one, in their order."""
    following = {part.get("PREVIOUS_ANNOTATION"): part for part in siblings}
    ordered: list[ET.Element] = []
    part = following.get(None)
    while part is not None and len(ordered) < len(siblings):
        ordered.append(part)
        part = following.get(part.get("ANNOTATION_ID"))
    return ordered if len(ordered) == len(siblings) else siblings


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

"""Records that are too short to be driven by their own speech at another moment, named before the first job."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from cospeech.workflow.config import Config
from cospeech.workflow.records import Record


def lines(config: Config, listed: Mapping[str, Record], shortest_s: float) -> list[str]:
    """Return one line for each record that is known to be shorter than ``shortest_s``.

    A record whose duration only shows when its files are read is left out as well, and named on the page.
    """
    found = []
    for name, duration_s in durations(config, listed).items():
        if duration_s < shortest_s:
            found.append(
                f"record '{name}': its {duration_s:.1f} s are too short for a shift of "
                f"{config['synthesis']['shift_s']:g} s in either direction between its ends; the controls with "
                "shifted speech leave it out (use longer records, or lower synthesis.shift_s)"
            )
    return found


def durations(config: Config, listed: Mapping[str, Record]) -> dict[str, float]:
    """Return the duration in seconds of each record for which the configuration or a header states it."""
    if config["corpus"]["source"] == "studio":
        of_actor = {actor["actor"]: float(actor["duration_s"]) for actor in config["studio"]["actors"]}
        return {name: of_actor[record["actor"]] for name, record in listed.items()}
    known = {name: _duration(record, config["speech"]["frame_s"]) for name, record in listed.items()}
    return {name: duration_s for name, duration_s in known.items() if duration_s is not None}


def _duration(record: Record, frame_s: float) -> float | None:
    start = record["start_s"] or 0.0
    end = record["end_s"] if record["end_s"] is not None else _length(record, frame_s)
    return None if end is None else end - start


def _length(record: Record, frame_s: float) -> float | None:
    """Return the length of the speech of a record as its header states it; None if it cannot be read."""
    try:
        if record["audio"]:
            import soundfile  # imported here because most runs need neither

            return float(soundfile.info(record["audio"]).duration)
        if record["prosody"] and Path(record["prosody"]).suffix == ".parquet":
            import pyarrow.parquet

            return float(pyarrow.parquet.read_metadata(record["prosody"]).num_rows * frame_s)
    except (OSError, RuntimeError, ValueError):
        return None  # the job that reads the file says what is wrong with it
    return None

"""Keyword spotting of a run of route directions next to pocketsphinx, which needs the extra `keywords`.

    python bench/keywords.py results/directions

Prints, for the tested answers, the keywords found and the other words mistaken for one: by the word HMMs of the run,
by the keyword spotter of pocketsphinx, and by its full decoding.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import soundfile
from pocketsphinx import Decoder

from cospeech.evaluation import directions
from cospeech.studio.directions.sentences import KEYWORDS

THRESHOLD = "1e-20"
"""Threshold of each keyword, as in the examples of pocketsphinx."""
LEVEL = 0.95


def decoded(decoder: Decoder, record: str, samples: np.ndarray) -> list[tuple[str, float, float, str]]:
    """Return the keywords in a sound at 16 kHz: record, start and end in seconds, word."""
    decoder.start_utt()
    decoder.process_raw((32767 * samples).astype(np.int16).tobytes(), full_utt=True)
    decoder.end_utt()
    words = ((part.word.split("(")[0].strip(), part.start_frame, part.end_frame) for part in decoder.seg() or [])
    return [(record, start / 100, (end + 1) / 100, word) for word, start, end in words if word in KEYWORDS]


def spotter(folder: Path) -> Decoder:
    """Return a decoder that only listens for keywords."""
    listed = folder / "keywords.list"
    listed.write_text("".join(f"{word} /{THRESHOLD}/\n" for word in KEYWORDS), encoding="utf-8")
    return Decoder(kws=str(listed), lm=None, loglevel="FATAL")


def report(name: str, found: pd.DataFrame, words: pd.DataFrame) -> None:
    """Print the shares of keywords found and of false alarms."""
    table = directions.keywords(
        found.assign(task="keywords", method=name, setting=0, portion="test"), words, list(KEYWORDS), LEVEL
    )
    whole = table[table["label"].isna()].set_index("measure")
    shares = [
        f"{row['hits']:4d} of {row['number']:4d} ({row['low']:.3f} to {row['high']:.3f})"
        for _, row in whole.iterrows()
    ]
    print(f"{name:24s} found {shares[0]}   false alarms {shares[1]}")


def main(results: Path) -> None:
    """Compare the run in a folder of results with pocketsphinx."""
    records = pd.read_parquet(results / "directions/records.parquet").query("portion == 'test'")
    events = pd.read_parquet(results / "corpus/truth/direction_events.parquet")
    words = events[(events["tier"] == "word") & events["record"].isin(records["record"])]
    own = pd.read_parquet(results / "directions/detections/keywords.parquet").query("portion == 'test'")
    for gaussians, found in own.groupby("setting"):
        report(f"word HMMs, {gaussians} Gaussians", found, words)
    with tempfile.TemporaryDirectory() as folder:
        for name, decoder in (
            ("pocketsphinx, spotting", spotter(Path(folder))),
            ("pocketsphinx, decoding", Decoder(loglevel="FATAL")),
        ):
            rows = [
                row
                for record, sound in zip(records["record"], records["sound"], strict=True)
                for row in decoded(decoder, record, soundfile.read(sound)[0])
            ]
            report(name, pd.DataFrame(rows, columns=["record", "start_s", "end_s", "label"]), words)


if __name__ == "__main__":
    main(Path(sys.argv[1]))

"""The process of ``recogniser``: sound on standard input, the keywords in it on standard output.

``python -m cospeech.live.spotting RATE_HZ WORD...`` reads samples of 32 bits (little-endian floating-point numbers,
full scale 1). It answers with a line ``ready``, or with one that says what is wrong, and then with one per keyword.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import soxr

from cospeech.data.arrays import Floats
from cospeech.errors import UserError

RATE_HZ = 16000
"""Sampling rate of the acoustic model."""

THRESHOLD = 1e-3
"""Likelihood ratio above which a word has been said. Lower ones find few further words, but more false ones."""

READ_BYTES = 4096


def decoder(words: Sequence[str]) -> Any:
    """Return a decoder that looks for words.

    Raises
    ------
    UserError : if pocketsphinx is not installed, or its dictionary lacks one of the words.
    """
    try:
        import pocketsphinx
    except ImportError as error:
        raise UserError("the package pocketsphinx is not installed; pip install 'cospeech[keywords]'") from error
    model = Path(pocketsphinx.get_model_path()) / "en-us"
    made = pocketsphinx.Decoder(
        hmm=str(model / "en-us"), dict=str(model / "cmudict-en-us.dict"), lm=None, loglevel="FATAL"
    )
    for word in words:
        for part in word.lower().split():
            if made.lookup_word(part) is None:
                raise UserError(
                    f"keyword '{word}': '{part}' is not in the English dictionary of pocketsphinx; use another word"
                )
    with tempfile.TemporaryDirectory() as folder:
        listed = Path(folder) / "words"
        listed.write_text("".join(f"{word.lower()} /{THRESHOLD:g}/\n" for word in words), encoding="utf-8")
        made.add_kws("words", str(listed))
    made.activate_search("words")
    return made


def spot(decoding: Any, words: Sequence[str], chunks: Iterator[Floats]) -> Iterator[str]:
    """Yield the words that are recognised in chunks of samples (n,) at 16 kHz, full scale 1."""
    of_spelling = {word.lower(): word for word in words}
    decoding.start_utt()
    for chunk in chunks:
        if not len(chunk):  # a resampler holds back the first samples, and the decoder does not accept an empty chunk
            continue
        samples = np.clip(np.round(32768.0 * np.nan_to_num(chunk)), -32768, 32767)
        decoding.process_raw(samples.astype("<i2").tobytes())
        if decoding.hyp() is not None:
            for segment in decoding.seg():
                yield of_spelling[segment.word.strip()]
            decoding.end_utt()
            decoding.start_utt()
    decoding.end_utt()


def read(stream: BinaryIO, rate_hz: int) -> Iterator[Floats]:
    """Yield the samples of a stream, resampled to 16 kHz."""
    resampler = soxr.ResampleStream(rate_hz, RATE_HZ, 1, dtype="float32", quality="LQ")
    rest = b""
    while received := os.read(stream.fileno(), READ_BYTES):
        data = rest + received
        whole = len(data) - len(data) % 4
        rest = data[whole:]
        samples = np.frombuffer(data[:whole], "<f4")
        yield samples if rate_hz == RATE_HZ else resampler.resample_chunk(samples)


def main(arguments: Sequence[str]) -> None:
    """Recognise the words of the arguments until the sound ends."""
    rate_hz, *words = arguments
    try:
        decoding = decoder(words)
    except UserError as error:
        print(error, flush=True)
        return
    print("ready", flush=True)
    for word in spot(decoding, words, read(sys.stdin.buffer, int(rate_hz))):
        print(word, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])

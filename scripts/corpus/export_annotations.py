"""Export the gesture phrases of one record to ELAN and Praat, for manual correction."""

import os
from pathlib import Path

from cospeech.corpus import annotations
from cospeech.formats import elan, textgrid
from cospeech.workflow import job

with job.run(snakemake) as work:
    segments = work.read(work.input.phrases, "segments")
    spans, duration_s = annotations.segment_spans(segments), float(segments["end_s"].iloc[-1])
    audio = work.input.get("audio")
    media = Path(os.path.relpath(audio, Path(work.output.eaf).parent)).as_posix() if audio else None
    elan.write(work.output.eaf, annotations.TIER, spans, work.params["labels"], media)
    textgrid.write(work.output.textgrid, annotations.TIER, spans, duration_s)

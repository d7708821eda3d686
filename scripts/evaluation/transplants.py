"""One actor's model under another actor's voice, in numbers."""

import pandas as pd

from cospeech.evaluation import transplant
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, rows = work.params, []
    for (model, voice, record), *paths in zip(given["pairs"], work.input.own, work.input.transplanted, strict=True):
        own, moved = (work.read(path, "segments") for path in paths)
        origin = {"record": record, "voice_actor": voice, "system": given["system"], "variant": given["variant"]}
        for source, actor, phrases, reference in (("own_model", voice, own, None), ("transplant", model, moved, own)):
            found = transplant.row(phrases, reference, given["frame_s"])
            rows.append(origin | {"source": source, "model_actor": actor} | found)
    work.write(pd.DataFrame(rows), work.output.table, "transplant")

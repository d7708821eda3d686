"""Segment one record with its actor's gesture model; evaluation uses the result as the actual phrases.

Its gesture phases and subunits, which were found with the model, become tables of its own.
"""

from pathlib import Path

from cospeech.markov import labelled_hmm
from cospeech.segmentation import gesture
from cospeech.workflow import job

with job.run(snakemake) as work:
    segments = gesture.phrases(
        labelled_hmm.from_table(work.read(work.input.model, "hmm_model")),
        work.wildcards.record,
        work.read(work.input.motion, "motion"),
        work.read(work.input.annotations, "annotations"),
    )
    work.write(segments, work.output.segments, "segments")
    folder, record = Path(work.params["folder"]), work.wildcards.record
    for kind, schema in work.params["tables"].items():
        of_actor = work.read(str(folder / kind / f"{work.params['place']}.parquet"), schema)
        work.write(of_actor[of_actor["record"] == record], folder / kind / f"{record}.parquet", schema)

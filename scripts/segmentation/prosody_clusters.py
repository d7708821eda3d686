"""Train the prosody clusters of one fold, and segment the actor's records into intonation phrases."""

from pathlib import Path

from cospeech.markov import labelled_hmm
from cospeech.segmentation import prosody
from cospeech.workflow import job

with job.run(snakemake) as work:
    records = work.params["records"]
    tables = {record: work.read(path, "prosody") for record, path in zip(records, work.input.prosody, strict=True)}
    training = [tables[record] for record in work.params["training"]]
    found = prosody.train(training, *work.params["setting"], work.params["settings"], work.params["seed"])
    work.say(prosody.summary(found.fit))
    segments = Path(work.output.segments)
    work.write(labelled_hmm.to_table(found.model), segments.with_name("model.parquet"), "hmm_model")
    work.write(found.fit, segments.with_name("fit.parquet"), "hmm_fit")
    work.write(prosody.phrases(found.model, tables, work.params["frame_s"]), segments, "segments")

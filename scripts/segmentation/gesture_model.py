"""Train the gesture model of one actor on all of the actor's records, and find their gesture phases and subunits."""

from pathlib import Path

from cospeech.markov import labelled_hmm
from cospeech.segmentation import gesture, phases, subunits
from cospeech.workflow import job

with job.run(snakemake) as work:
    records = work.params["records"]
    motions = {record: work.read(path, "motion") for record, path in zip(records, work.input.motion, strict=True)}
    training = gesture.train(motions, work.read(work.input.annotations, "annotations"), work.params["settings"])
    for note in training.notes:
        work.say(note)
    work.write(labelled_hmm.to_table(training.model), work.output.model, "hmm_model")
    work.write(training.fit, work.output.fit, "hmm_fit")
    folder, place = Path(work.params["folder"]), f"{work.params['place']}.parquet"
    segmentation = work.params["segmentation"]
    work.write(phases.find(motions, segmentation["phases"]), folder / "phases" / place, "phases")
    for section, table in subunits.find(motions, segmentation["subunits"]).items():
        work.write(table, folder / "subunits" / section / place, "subunits")

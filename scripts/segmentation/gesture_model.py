"""Train the gesture model of one actor on all of the actor's records."""

from cospeech.segmentation import gesture, labelled_hmm
from cospeech.workflow import job

with job.run(snakemake) as work:
    records = work.params["records"]
    training = gesture.train(
        {record: work.read(path, "motion") for record, path in zip(records, work.input.motion, strict=True)},
        work.read(work.input.annotations, "annotations"),
        work.params["settings"],
    )
    for note in training.notes:
        work.say(note)
    work.write(labelled_hmm.to_table(training.model), work.output.model, "hmm_model")
    work.write(training.fit, work.output.fit, "hmm_fit")

"""Train the gesture model of one fold without its held-out record, and segment the fold's training records."""

from cospeech.segmentation import gesture, labelled_hmm
from cospeech.workflow import job

with job.run(snakemake) as work:
    records = work.params["records"]
    motions = {record: work.read(path, "motion") for record, path in zip(records, work.input.motion, strict=True)}
    annotations = work.read(work.input.annotations, "annotations")
    training = gesture.train(motions, annotations, work.params["settings"])
    for note in training.notes:
        work.say(note)
    found = [gesture.phrases(training.model, record, motion, annotations) for record, motion in motions.items()]
    work.write(found, work.output.segments, "segments")
    work.write(labelled_hmm.to_table(training.model), work.output.model, "hmm_model")
    work.write(training.fit, work.output.fit, "hmm_fit")

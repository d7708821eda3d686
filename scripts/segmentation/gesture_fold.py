"""The gesture phrase model of one fold, trained without the held-out record, and the phrases of the other records."""

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

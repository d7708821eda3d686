"""One fold at each setting of the sweep: its prosody clusters, its HSMM, and its phrases, printed and weighted."""

from cospeech.markov import hsmm as semi
from cospeech.segmentation import labelled_hmm as model
from cospeech.segmentation import prosody
from cospeech.synthesis import hsmm, hsmm_weighted
from cospeech.synthesis.fold import fold
from cospeech.synthesis.speech import frame_labels, heard
from cospeech.workflow import job

with job.run(snakemake) as work:
    record, frame_s, censoring = work.wildcards.record, work.params["frame_s"], work.params["censoring"]
    records = work.params["records"]
    tables = {name: work.read(path, "prosody") for name, path in zip(records, work.input.prosody, strict=True)}
    training = [tables[name] for name in work.params["training"]]
    gestures = work.read(work.input.gestures, "segments")
    for place, (clusters, states) in enumerate(work.followed(work.params["sweep"], "settings")):
        found = prosody.train(training, clusters, states, work.params["settings"], work.params["seed"])
        segments = prosody.phrases(found.model, tables, frame_s)
        work.write(segments, work.output.segments[place], "segments")
        work.write(model.to_table(found.model), work.output.model[place], "hmm_model")
        work.write(found.fit, work.output.fit[place], "hmm_fit")

        how = hsmm.Estimate(clusters=clusters, **work.params["estimate"])
        known = fold(record, gestures, segments, frame_s)
        counts = hsmm.counts(known, how)
        learnt = hsmm.train(counts.values(), how)
        paths = work.output.tables[place * len(semi.TABLES) : (place + 1) * len(semi.TABLES)]
        for (name, table), path in zip(semi.to_tables(learnt, frame_s, how.floor).items(), paths, strict=True):
            work.write(table, path, name)
        speech = heard(frame_labels(segments), record, frame_s)
        printed = hsmm.synthesise(learnt, speech, censoring=censoring)
        work.write(printed.phrases, work.output.phrases[place], "segments")
        work.write(printed.decoding, work.output.decoding[place], "decoding")
        weight = hsmm_weighted.choose_weight(known, counts, how, work.params["weights"], censoring)
        weighted = hsmm.synthesise(learnt, speech, weight, censoring)
        work.write(weighted.phrases, work.output.weighted_phrases[place], "segments")
        work.write(weighted.decoding, work.output.weighted_decoding[place], "decoding")
        work.say(f"{clusters} clusters of {states} states: {prosody.summary(found.fit)}, emission weight {weight:g}")

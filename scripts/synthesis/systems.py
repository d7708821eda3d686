"""The phrases of one fold by many systems: the HSMM in its forms, all that hears wrong speech or none, ceilings."""

from cospeech.markov import hsmm as semi
from cospeech.synthesis import (
    another,
    clock,
    hsmm,
    hsmm_sampled,
    hsmm_weighted,
    majority,
    oracle,
    prior,
    random_phrases,
    systems,
    wrong_speech,
)
from cospeech.synthesis.fold import fold
from cospeech.synthesis.speech import frame_labels, heard
from cospeech.workflow import job

with job.run(snakemake) as work:
    record, frame_s, seed = work.wildcards.record, work.params["frame_s"], work.params["seed"]
    censoring, weights, shift_s = work.params["censoring"], work.params["weights"], work.params["shift_s"]
    how = hsmm.Estimate(**work.params["estimate"])
    gestures = work.read(work.input.gestures, "segments")
    prosody = work.read(work.input.prosody, "segments")
    labels = frame_labels(prosody)
    known, own = fold(record, gestures, prosody, frame_s), heard(labels, record, frame_s)

    def write_tables(model, paths):
        for (name, table), path in zip(semi.to_tables(model, frame_s, how.floor).items(), paths, strict=True):
            work.write(table, path, name)

    counts = hsmm.counts(known, how)
    model = hsmm.train(counts.values(), how)
    weight = hsmm_weighted.choose_weight(known, counts, how, weights, censoring)
    work.say(f"hsmm_weighted: emission weight {weight:g}")
    write_tables(model, work.output.hsmm)

    made = {
        "hsmm": hsmm.synthesise(model, own, censoring=censoring),
        "hsmm_weighted": hsmm.synthesise(model, own, weight, censoring),
        "hsmm_sampled": hsmm_sampled.synthesise(model, own, weight, censoring, seed),
        "random": random_phrases.synthesise(known, seed),
        "prior": prior.synthesise(model, own, censoring),
        "clock": clock.synthesise(known),
        "majority": majority.synthesise(known),
        "another": another.synthesise(known, work.params["records"]),
    }
    if "oracle" in work.params["systems"]:
        planted = dict(zip(semi.TABLES, work.input.planted, strict=True))
        truth = {name: work.read(path, name) for name, path in planted.items()}
        planted_gestures = work.read(work.input.planted_gestures, "segments")
        planted_prosody = work.read(work.input.planted_prosody, "segments")
        ideal = oracle.planted_model(truth, work.params["actor"], how.floor)
        spoken = oracle.planted_prosody(planted_prosody, prosody, frame_s)
        seen = fold(record, planted_gestures[planted_gestures["record"].isin(labels)], spoken, frame_s)
        best = oracle.choose_weight(seen, ideal, weights, censoring)
        work.say(f"oracle: emission weight {best:g}")
        made["oracle"] = hsmm.synthesise(ideal, heard(frame_labels(spoken), record, frame_s), best, censoring)
        write_tables(ideal, work.output.oracle)

    known_systems = systems(studio=False)
    for place, name in enumerate(work.params["systems"]):
        if name not in made:
            control = known_systems[name]
            speech = heard(labels, record, frame_s, control.drive, seed, shift_s)
            made[name] = wrong_speech.synthesise(control, model, speech, weight, censoring, seed)
        work.write(made[name].phrases, work.output.phrases[place], "segments")
        work.write(made[name].decoding, work.output.decoding[place], "decoding")

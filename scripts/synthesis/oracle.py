"""The phrases of one fold by the planted model under the planted prosody, and the tables of that model."""

from cospeech import job
from cospeech.markov import semi
from cospeech.synthesis import hsmm, oracle
from cospeech.synthesis.fold import fold
from cospeech.synthesis.speech import frame_labels, heard

with job.run(snakemake) as work:
    record, frame_s, censoring = work.wildcards.record, work.params["frame_s"], work.params["censoring"]
    found = work.read(work.input.found, "segments")
    gestures = work.read(work.input.gestures, "segments")
    prosody = oracle.planted_prosody(work.read(work.input.prosody, "segments"), found, frame_s)
    truth = {name: work.read(work.input.get(name), name) for name in semi.TABLES}
    model = oracle.planted_model(truth, work.params["actor"], work.params["floor"])
    known = fold(record, gestures[gestures["record"].isin(found["record"])], prosody, frame_s)
    weight = oracle.choose_weight(known, model, work.params["weights"], censoring)
    work.say(f"emission weight {weight:g}")
    made = hsmm.synthesise(model, heard(frame_labels(prosody), record, frame_s), weight, censoring)
    work.write(made.phrases, work.output.phrases, "segments")
    work.write(made.decoding, work.output.decoding, "decoding")
    for name, table in semi.to_tables(model, frame_s, work.params["floor"]).items():
        work.write(table, work.output.get(name), name)

"""The printed HSMM of one fold, its four tables and its phrases, at each setting of the prosody clusters."""

import pandas as pd

from cospeech import job
from cospeech.markov import semi
from cospeech.synthesis import hsmm
from cospeech.synthesis.fold import fold
from cospeech.synthesis.speech import frame_labels, heard

with job.run(snakemake) as work:
    record, frame_s = work.wildcards.record, work.params["frame_s"]
    gestures = pd.concat([work.read(path, "segments") for path in work.input.gestures])
    for place, clusters in enumerate(work.params["clusters"]):
        prosody = work.read(work.input.prosody[place], "segments")
        how = hsmm.Estimate(clusters=clusters, **work.params["estimate"])
        model = hsmm.train(hsmm.counts(fold(record, gestures, prosody, frame_s), how).values(), how)
        speech = heard(frame_labels(prosody), record, frame_s)
        made = hsmm.synthesise(model, speech, censoring=work.params["censoring"])
        work.write(made.phrases, work.output.phrases[place], "segments")
        work.write(made.decoding, work.output.decoding[place], "decoding")
        for name, table in semi.to_tables(model, frame_s, how.floor).items():
            work.write(table, work.output.get(name)[place], name)

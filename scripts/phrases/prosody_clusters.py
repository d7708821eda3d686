"""The prosody clusters of one fold, at one setting or several, and the intonation phrases of the actor's records."""

import pandas as pd

from cospeech import job
from cospeech.phrases import model, prosody

with job.run(snakemake) as work:
    records = work.params["records"]
    tables = {record: work.read(path, "prosody") for record, path in zip(records, work.input.prosody, strict=True)}
    training = [tables[record] for record in work.params["training"]]
    for place, (clusters, states) in enumerate(work.followed(work.params["clusters"], "settings")):
        found = prosody.train(training, clusters, states, work.params["settings"], work.params["seed"])
        work.say(f"{clusters} clusters of {states} states: {prosody.summary(found.fit)}")
        phrases = [
            prosody.phrases(found.model, record, table, work.params["frame_s"]) for record, table in tables.items()
        ]
        work.write(pd.concat(phrases), work.output.segments[place], "segments")
        work.write(model.to_table(found.model), work.output.model[place], "hmm_model")
        work.write(found.fit, work.output.fit[place], "hmm_fit")

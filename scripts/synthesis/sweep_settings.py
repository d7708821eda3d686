"""One fold at each setting of the sweep: its prosody clusters, and the phrases of the systems that are swept."""

from pathlib import Path

from cospeech.data.vocabulary import prosody_labels
from cospeech.markov import labelled_hmm
from cospeech.segmentation import prosody
from cospeech.synthesis.registry import installed
from cospeech.synthesis.session import Driving, Session
from cospeech.synthesis.training import Actor, fold
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, record, records, frame_s = (
        work.params,
        work.wildcards.record,
        work.params["records"],
        work.params["frame_s"],
    )
    tables = work.read_each(records, work.input.prosody, "prosody")
    gestures = work.read(work.input.gestures, "segments")
    systems, planned = [installed(name) for name in given["systems"]], []
    for number, (clusters, states) in enumerate(work.followed(given["sweep"], "settings")):
        found = prosody.train(
            [tables[name] for name in given["training"]], clusters, states, given["settings"], given["seed"]
        )
        clustered = prosody.phrases(found.model, tables, frame_s)
        segments = Path(work.output.segments[number])
        work.write(labelled_hmm.to_table(found.model), segments.with_name("model.parquet"), "hmm_model")
        work.write(found.fit, segments.with_name("fit.parquet"), "hmm_fit")
        work.write(clustered, segments, "segments")

        actor = Actor(given["actor"], records, frame_s, given["labels"], prosody_labels(clusters))
        training, streams = fold(actor, record, gestures, clustered)
        session, driving = (
            Session(training, given["shared"], given["own"]),
            Driving(streams, record, frame_s, given["seed"]),
        )
        for system in systems:
            [made] = session.synthesise(system, driving)
            variant, place = given["places"][number][system.name]
            folder = f"{place}/{record}"
            work.write(made.phrases, f"{folder}/phrases.parquet", "segments")
            work.write(made.decoding, f"{folder}/decoding.parquet", "decoding")
            planned.append(made.phrases.assign(system=system.name, variant=variant, draw=0))
            if system.name in given["tables"]:
                model = session.tables(system)
                for table, schema in given["tables"][system.name].items():
                    work.write(model[table], f"{folder}/{table}.parquet", schema)
        work.say(f"{clusters} clusters of {states} states: {prosody.summary(found.fit)}")
    work.write(planned, work.output.planned, "planned_phrases")

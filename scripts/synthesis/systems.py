"""Gesture phrases, or motion, of one record by several systems."""

from cospeech.motion import skeleton
from cospeech.synthesis.registry import installed
from cospeech.synthesis.session import Driving, Session
from cospeech.synthesis.training import Actor, Truth, fold
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, record, records = work.params, work.wildcards.record, work.params["records"]
    actor = Actor(given["actor"], records, given["frame_s"], given["labels"], given["symbols"])
    truth = None
    if given["planted"]:
        truth = Truth(
            {name: work.read(path, name) for name, path in zip(given["planted"], work.input.planted, strict=True)},
            work.read(work.input.planted_gestures, "segments"),
            work.read(work.input.planted_prosody, "segments"),
        )
    motions = work.read_each(records, work.input.motions, "motion")
    training, streams = fold(
        actor,
        record,
        work.read(work.input.gestures, "segments"),
        work.read(work.input.clusters, "segments"),
        work.read_each(records, work.input.prosody, "prosody"),
        motions,
        truth,
    )
    session = Session(training, given["shared"], given["own"])
    fps = skeleton.frame_rate(motions[record]) if motions else 0.0
    driving = Driving(
        streams, record, actor.frame_s, given["seed"], given["shift_s"], fps, len(motions.get(record, ()))
    )
    made = {}
    for system in map(installed, given["systems"]):
        made[system.name] = (session.attempt if given["apart"] else session.synthesise)(system, driving)
        failure = made[system.name].decoding["failure"].iloc[0]
        if failure:
            work.warn(failure)
    work.write_each([made[name].phrases for name in given["phrases"]], work.output.phrases, "segments")
    work.write_each([made[name].motion for name in given["motion"]], work.output.motion, "motion")
    work.write_each([made[name].decoding for name in given["systems"]], work.output.decoding, "decoding")
    for (name, table, schema), path in zip(given["tables"], work.output.tables, strict=True):
        work.write(session.tables(installed(name))[table], path, schema)

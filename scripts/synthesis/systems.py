"""Gesture phrases, or motion, of one record by several systems; controls that depend on chance draw repeatedly.

The phrases or the motion in the folder of a system are those of its first draw; they are empty if a matched control
leaves the record out. The phrases of all draws are in the table of planned phrases.
"""

from pathlib import Path

import pandas as pd

from cospeech.data import tables as files
from cospeech.evaluation import motion_scores
from cospeech.markov import labelled_hmm
from cospeech.motion import skeleton
from cospeech.segmentation import gesture
from cospeech.synthesis.registry import installed
from cospeech.synthesis.session import Driving, Session
from cospeech.synthesis.speech import Wrong
from cospeech.synthesis.training import Actor, Truth, fold
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, record, records = work.params, work.wildcards.record, work.params["records"]
    actor = Actor(given["actor"], records, given["frame_s"], given["labels"], given["symbols"])
    truth = None
    if given["planted"]:
        folder = Path(work.input.planted).parent  # one of the tables that a job plants stands for all of them
        truth = Truth(
            {name: work.read(str(folder / f"{name}.parquet"), name) for name in given["planted"]},
            work.read(work.input.planted, "segments"),
            work.read(str(folder / "prosody_phrases.parquet"), "segments"),
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
        work.read_each(records, work.input.syllables, "syllables"),
        work.read(given["phases"], "phases") if given["phases"] else None,
        {section: work.read(path, "subunits") for section, path in given["subunits"].items()},
    )
    session = Session(training, given["shared"], given["own"])
    fps = skeleton.frame_rate(motions[record]) if motions else 0.0
    driving = Driving(
        streams, record, actor.frame_s, given["seed"], Wrong(**given["wrong"]), fps, len(motions.get(record, ()))
    )
    gesture_model = labelled_hmm.from_table(work.read(work.input.model, "hmm_model")) if work.input.model else None
    spoken = work.read(work.input.spoken, "syllables") if work.input.spoken else None
    planned, seen, scores, failures = [], [], [], []
    for system in map(installed, given["systems"]):
        draws = (session.attempt if given["apart"] else session.synthesise)(system, driving)
        variant, place = given["places"][system.name]
        folder = f"{place}/{record}"
        first = draws[0] if draws else None
        named = {"system": system.name, "variant": variant}
        if system.makes == "phrases":
            work.write(first.phrases if first else files.empty("segments"), f"{folder}/phrases.parquet", "segments")
            planned += [made.phrases.assign(**named, draw=draw) for draw, made in enumerate(draws)]
        else:
            work.write(first.motion if first else files.empty("motion"), f"{folder}/motion.parquet", "motion")
            made = [one.motion for one in draws]
            for draw, motion in enumerate(motion for motion in made if len(motion)):
                phrases = gesture.unconstrained_phrases(gesture_model, record, motion)
                seen.append(phrases.assign(**named, draw=draw))
            ends = {key: given["wrong"][key] for key in ("head_s", "tail_s")}
            named |= {"record": record}
            scores.append(motion_scores.table(named, motions[record], made, spoken, **ends))
        decoding = pd.concat([made.decoding for made in draws]) if draws else files.empty("decoding")
        work.write(decoding, f"{folder}/decoding.parquet", "decoding")
        failure = first.decoding["failure"].iloc[0] if first else None
        if isinstance(failure, str):
            failures.append(f"{record}: {failure}")
        elif system.name in given["tables"]:
            tables = session.tables(system)
            for table, schema in given["tables"][system.name].items():
                work.write(tables[table], f"{folder}/{table}.parquet", schema)
        if system.reports and system.drive == "own" and not isinstance(failure, str):
            for table, found in session.reports(system, driving).items():
                work.write(found, f"{folder}/{table}.parquet", system.report_schemas[table])
    if work.output.planned:
        work.write(planned, work.output.planned, "planned_phrases")
    if work.output.seen:
        work.write(seen or files.empty("planned_phrases"), work.output.seen, "planned_phrases")
        work.write(scores, work.output.scores, "motion_scores")
    if failures:  # a system and its controls mostly fail for the same reason
        work.warn(failures[0])
        work.say("\n".join(failures[1:]))

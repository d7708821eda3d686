"""Angles of the head of one record by several systems, and their scores; controls draw repeatedly.

The angles in the folder of a system are those of its first draw; they are empty if a matched control leaves the
record out. The scores are those of all draws. Reports are made of the record that the exhibits show, and are empty
for others.
"""

import pandas as pd

from cospeech.data import tables as files
from cospeech.evaluation import head_sessions
from cospeech.motion import head
from cospeech.synthesis.registry import installed
from cospeech.synthesis.session import Driving, Session
from cospeech.synthesis.speech import Wrong
from cospeech.synthesis.training import MELODY_S, head_fold
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, record, records = work.params, work.wildcards.record, work.params["records"]
    heads = work.read_each(records, work.input.heads, "head")
    training, streams = head_fold(
        given["actor"], record, work.read_each(records, work.input.melodies, "melody"), heads
    )
    session, original = Session(training, given["shared"], given["own"]), heads[record]
    driving = Driving(
        streams, record, MELODY_S, given["seed"], Wrong(**given["wrong"]), head.frame_rate(original), len(original)
    )
    scores, failures = [], []
    for system in map(installed, given["systems"]):
        draws = (session.attempt if given["apart"] else session.synthesise)(system, driving)
        variant, place = given["places"][system.name]
        folder, first = f"{place}/{record}", draws[0] if draws else None
        work.write(first.head if first else files.empty("head"), f"{folder}/head.parquet", "head")
        decoding = pd.concat([made.decoding for made in draws]) if draws else files.empty("decoding")
        work.write(decoding, f"{folder}/decoding.parquet", "decoding")
        failure = first.decoding["failure"].iloc[0] if first else None
        if isinstance(failure, str):
            failures.append(f"{record}: {failure}")
            continue
        named = {"system": system.name, "variant": variant, "actor": given["actor"], "record": record}
        scores += [
            head_sessions.scored(original, made.head).assign(**named, draw=draw) for draw, made in enumerate(draws)
        ]
        if system.name in given["tables"]:
            tables = session.tables(system)
            for table, schema in given["tables"][system.name].items():
                work.write(tables[table], f"{folder}/{table}.parquet", schema)
        if system.reports and system.drive == "own":
            found = session.reports(system, driving) if record == given["shown"] else {}
            for table, schema in system.report_schemas.items():
                work.write(found.get(table, files.empty(schema)), f"{folder}/{table}.parquet", schema)
    work.write(scores or files.empty("head_scores"), work.output.scores, "head_scores")
    if failures:  # a system and its controls mostly fail for the same reason
        work.warn(failures[0])
        work.say("\n".join(failures[1:]))

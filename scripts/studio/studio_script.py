"""Sample the script of all records: the planted behaviour of the cast, and the phrases of gesture and speech."""

import pandas as pd

from cospeech.data.rng import random_source
from cospeech.studio import cast, script
from cospeech.workflow import job

with job.run(snakemake) as work:
    coupling, frame_s, seed = work.params["coupling"], work.params["frame_s"], work.params["seed"]
    members, gestures, prosody, annotations = [], [], [], []
    for actor, records in work.params["records"].items():
        member = cast.member(actor, seed, frame_s, work.params["max_duration_s"])
        duration_s = work.params["durations_s"][actor]
        written = [script.write(member, record, duration_s, coupling, frame_s, seed) for record in records]
        members.append(member)
        gestures.append(pd.concat([own for own, _ in written], ignore_index=True))
        prosody.extend(spoken for _, spoken in written)
        rng = random_source(seed, "examples", actor)
        annotations.append(script.examples(gestures[-1], work.params["examples"], rng))
    for name, table in cast.tables(members, coupling, frame_s).items():
        work.write(table, work.output[name], name)
    work.write(gestures, work.output.gesture_phrases, "segments")
    work.write(prosody, work.output.prosody_phrases, "segments")
    work.write(annotations, work.output.annotations, "annotations")

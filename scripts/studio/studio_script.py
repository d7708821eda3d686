"""Sample the script of all records: the planted behaviour of the cast, and what is planted in every record."""

from cospeech.data.rng import random_source
from cospeech.studio import cast, scenes, script, worlds
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, frame_s, seed = work.params, work.params["frame_s"], work.params["seed"]
    couplings = worlds.couplings(given["world"], given["coupling"], given["couplings"])
    players, members, written, annotations = {}, [], [], []
    for actor, records in given["records"].items():
        own = scenes.player(actor, given["world"], seed, frame_s, given["max_duration_s"])
        duration_s = given["durations_s"][actor]
        of_actor = [scenes.write(own, record, duration_s, couplings, frame_s, seed) for record in records]
        players[actor] = own
        members.append(scenes.gesture_model(own, given["max_duration_s"], frame_s, seed))
        written += of_actor
        rng = random_source(seed, "examples", actor)
        annotations.append(script.examples(scenes.tables(of_actor)["gesture_phrases"], given["examples"], rng))
    for name, table in cast.tables(members, couplings.phrases or 0.0, frame_s).items():
        work.write(table, work.output[name], name)
    for name, table in scenes.truth(players, couplings).items():
        work.write(table, work.output[name], name)
    for name, table in scenes.tables(written).items():
        work.write(table, work.output[name], scenes.TABLES[name][1])
    work.write(annotations, work.output.annotations, "annotations")

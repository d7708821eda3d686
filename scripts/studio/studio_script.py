"""Sample the script of all records: the planted behaviour of the cast, and what is planted in every record."""

from cospeech.data.rng import random_source
from cospeech.studio import cast, scenes, script, worlds
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, frame_s, seed = work.params, work.params["frame_s"], work.params["seed"]
    couplings = {actor: worlds.couplings(*own_world) for actor, own_world in given["worlds"].items()}
    players, members, written, annotations = {}, [], [], []
    for actor, records in given["records"].items():
        own = scenes.player(actor, given["worlds"][actor][0], seed, frame_s, given["max_duration_s"])
        duration_s = given["durations_s"][actor]
        of_actor = [scenes.write(own, record, duration_s, couplings[actor], frame_s, seed) for record in records]
        players[actor] = own
        members.append(scenes.gesture_model(own, given["max_duration_s"], frame_s, seed))
        written += of_actor
        rng = random_source(seed, "examples", actor)
        annotations.append(script.examples(scenes.tables(of_actor)["gesture_phrases"], given["examples"], rng))
    of_phrases = {actor: own.phrases or 0.0 for actor, own in couplings.items()}
    for name, table in cast.tables(members, of_phrases, frame_s).items():
        work.write(table, work.output[name], name)
    for name, table in scenes.truth(players, couplings).items():
        work.write(table, work.output[name], name)
    for name, table in scenes.tables(written).items():
        work.write(table, work.output[name], scenes.TABLES[name][1])
    work.write(annotations, work.output.annotations, "annotations")

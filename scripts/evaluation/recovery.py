"""How much of what the virtual studio planted is found again."""

from cospeech.evaluation import pitch, recovery
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, actors = work.params, work.params["actors"]
    planted_gestures = work.read(work.input.gesture_phrases, "segments")
    planted_prosody = work.read(work.input.prosody_phrases, "segments")
    transitions = work.read(work.input.transitions, "transitions")
    durations = work.read(work.input.durations, "durations")
    rows = []
    for record, path in zip(actors, work.input.gestures, strict=True):
        planted = planted_gestures[planted_gestures["record"] == record]
        found = recovery.gestures(planted, work.read(path, "segments"), given["frame_s"])
        rows += [row | {"actor": actors[record], "record": record} for row in found]
    for (clusters, states, fold), path in zip(given["clustered"], work.input.clusters, strict=True):
        found = recovery.prosody(planted_prosody, work.read(path, "segments"), held_out=fold)
        setting = {"actor": actors[fold], "record": fold, "clusters": clusters, "states": states}
        rows += [row | setting for row in found]
    heard = (work.input[name] for name in ("planted_prosody", "prosody", "pitch", "syllables"))
    for record, true, path, tracked, syllables in zip(actors, *heard, strict=False):
        planted, measured = work.read(true, "planted_prosody"), work.read(path, "prosody")
        found = recovery.pitch(planted, measured, given["voiced_gain"])
        found += pitch.errors(planted, measured, given["voiced_gain"], work.read(tracked, "pitch"))
        found += recovery.syllable_delays(work.read(syllables, "syllables"))
        rows += [row | {"actor": actors[record], "record": record} for row in found]
    for actor in dict.fromkeys(actors.values()):
        own = planted_gestures[planted_gestures["record"].map(actors) == actor]
        model = [table[table["actor"] == actor] for table in (transitions, durations)]
        rows += [row | {"actor": actor} for row in recovery.process(own, *model, given["seed"])]
    work.write(recovery.table(rows), work.output.recovery, "recovery")

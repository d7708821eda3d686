"""Synthesise the motion of one record for each animated system: selected units, motion table and BVH."""

from cospeech.formats import bvh
from cospeech.motion import assembly, skeleton, unit_selection
from cospeech.workflow import job

with job.run(snakemake) as work:
    settings = work.params["settings"]
    original = work.read(work.input.own, "motion")
    gestures = work.read(work.input.gestures, "segments")
    motions = {
        record: work.read(path, "motion")
        for record, path in zip(work.params["others"], work.input.motions, strict=True)
    }
    pool = unit_selection.templates(gestures, motions)
    fps, weight = skeleton.frame_rate(original), settings["continuity_weight"]
    for number, system in enumerate(settings["systems"]):
        phrases = work.read(work.input.phrases[number], "segments")
        selected = unit_selection.select(phrases, pool, len(original), fps, weight)
        motion = assembly.motion(selected, pool, motions, original, **settings["smoothing"])
        work.write(selected, work.output.units[number], "units")
        work.write(motion, work.output.motion[number], "motion")
        bvh.write(motion, work.output.bvh[number])
        work.say(f"{system}: {unit_selection.summary(selected, weight)}")

"""Motion of a record under each system that is to be animated: units, motion table and BVH."""

from cospeech.formats import bvh
from cospeech.motion import assembly, skeleton, unit_selection
from cospeech.workflow import job

with job.run(snakemake) as work:
    settings = work.params["settings"]
    own = work.read(work.input.own, "motion")
    gestures = work.read(work.input.gestures, "segments")
    motions = {
        record: work.read(path, "motion")
        for record, path in zip(work.params["others"], work.input.motions, strict=True)
    }
    pool = unit_selection.templates(gestures, motions)
    fps, weight = skeleton.frame_rate(own), settings["continuity_weight"]
    for number, system in enumerate(settings["systems"]):
        phrases = work.read(work.input.phrases[number], "segments")
        selected = unit_selection.select(phrases, pool, len(own), fps, weight)
        made = assembly.motion(selected, pool, motions, own, **settings["smoothing"])
        work.write(selected, work.output.units[number], "units")
        work.write(made, work.output.motion[number], "motion")
        bvh.write(made, work.output.bvh[number])
        work.say(f"{system}: {unit_selection.summary(selected, weight)}")

"""Motion of a record under several systems: units, motion table, BVH, and the phrases that are seen in the motion."""

from cospeech.formats import bvh
from cospeech.motion import assembly, skeleton, unit_selection
from cospeech.segmentation import gesture, labelled_hmm
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, record, settings = work.params, work.wildcards.record, work.params["settings"]
    own = work.read(work.input.own, "motion")
    model = labelled_hmm.from_table(work.read(work.input.model, "hmm_model"))
    motions = work.read_each(given["others"], work.input.motions, "motion")
    pool = unit_selection.templates(work.read(work.input.gestures, "segments"), motions)
    fps, weight = skeleton.frame_rate(own), settings["continuity_weight"]
    made = []
    for place, system in enumerate(given["planned"]):
        phrases = work.read(work.input.phrases[place], "segments")
        selected = unit_selection.select(phrases, pool, len(own), fps, weight)
        made.append(assembly.motion(selected, pool, motions, own, **settings["smoothing"]))
        work.write(selected, work.output.units[place], "units")
        work.write(made[place], work.output.motion[place], "motion")
        work.say(f"{system}: {unit_selection.summary(selected, weight)}")
    made += [work.read(path, "motion") for path in work.input.made]
    for motion, bvh_path, seen_path in zip(made, work.output.bvh, work.output.seen, strict=True):
        bvh.write(motion, bvh_path)
        work.write(gesture.seen(model, record, motion), seen_path, "segments")
    if work.output.original:
        work.write(gesture.seen(model, record, own), work.output.original, "segments")

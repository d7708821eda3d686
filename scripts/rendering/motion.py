"""Synthesise the motion of one record under several systems, and the phrases that are recognised in the motion.

A system that failed planned no phrases or made no frames; what this script makes of that is empty as well.
"""

from pathlib import Path

from cospeech.data import tables
from cospeech.evaluation import motion_scores
from cospeech.formats import bvh, glb_writer
from cospeech.markov import labelled_hmm
from cospeech.motion import assembly, library, skeleton, unit_selection
from cospeech.motion.body import STANDARD
from cospeech.rendering import export
from cospeech.segmentation import gesture
from cospeech.workflow import job

with job.run(snakemake) as work:
    record, settings = work.wildcards.record, work.params["settings"]
    original = work.read(work.input.own, "motion")
    model = labelled_hmm.from_table(work.read(work.input.model, "hmm_model"))
    motions = work.read_each(work.params["others"], work.input.motions, "motion")
    pool = unit_selection.templates(work.read(work.input.gestures, "segments"), motions)
    fps, weight = skeleton.frame_rate(original), settings["continuity_weight"]
    spoken = work.read(work.input.spoken, "syllables") if work.input.spoken else None
    synthesised, scores = [], []
    for place, (system, variant) in enumerate(work.params["planned"]):
        phrases = work.read(work.input.phrases[place], "segments")
        if phrases.empty:
            synthesised.append(original.iloc[:0])
            work.write(tables.empty("units"), work.output.units[place], "units")
            work.write(synthesised[place], work.output.motion[place], "motion")
            continue
        selected = unit_selection.select(phrases, pool, len(original), fps, weight)
        synthesised.append(assembly.motion(selected, pool, motions, original, **settings["smoothing"]))
        work.write(selected, work.output.units[place], "units")
        work.write(synthesised[place], work.output.motion[place], "motion")
        named = {"system": system, "variant": variant, "record": record}
        scores.append(motion_scores.table(named, original, synthesised[-1:], spoken, **work.params["interior"]))
        work.say(f"{system}: {unit_selection.summary(selected, weight)}")
    if work.output.scores:
        work.write(scores or tables.empty("motion_scores"), work.output.scores, "motion_scores")
    surface = export.surface()
    synthesised += [work.read(path, "motion") for path in work.input.made]
    for motion, bvh_path, seen_path in zip(synthesised, work.output.bvh, work.output.seen, strict=True):
        bvh.write(original.iloc[:0] if motion.empty else motion, bvh_path, fps)
        if not motion.empty:
            work.written.append(str(Path(bvh_path).with_suffix(".glb")))
            glb_writer.write(work.written[-1], record, STANDARD, library.from_motion(motion), fps, surface)
        seen = tables.empty("segments") if motion.empty else gesture.unconstrained_phrases(model, record, motion)
        work.write(seen, seen_path, "segments")
    if work.output.original:
        work.write(gesture.unconstrained_phrases(model, record, original), work.output.original, "segments")

"""Make a motion library without speech: BVH files of an actor in one situation, or of the creature."""

from cospeech.formats import bvh
from cospeech.studio import creature, libraries, motion
from cospeech.workflow import job

with job.run(snakemake) as work:
    library, fps, seed = work.wildcards.library, work.params["fps"], work.params["seed"]
    for number, duration_s in enumerate(libraries.durations_s(work.params["duration_s"]), start=1):
        record = f"{library}_{number}"
        path = f"{work.output.library}/{record}.bvh"
        if library in libraries.SITUATIONS:
            moved = libraries.perform(library, record, duration_s, fps, seed)
            bvh.write(motion.with_sensor_noise(moved, work.params["motion_noise_deg"], record, seed), path)
        else:
            bvh.write_clip(creature.perform(record, duration_s, fps, seed), path)
        work.say(f"{path}: {duration_s:.3f} s")

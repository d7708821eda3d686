"""Film the range-of-motion take of one actor from all cameras, and save the true positions of its markers."""

from cospeech.geometry import camera
from cospeech.studio import range_of_motion, take
from cospeech.workflow import job

with job.run(snakemake) as work:
    motion = range_of_motion.perform(work.params["motion_fps"])
    cameras = camera.from_table(work.read(work.input.cameras, "cameras"))
    actor, seed = work.wildcards.actor, work.params["seed"]
    in_views, in_world = take.shoot(motion, actor, cameras, work.output.films, seed)
    work.write(in_views, work.output.markers_2d, "markers_2d")
    work.write(in_world, work.output.markers_3d, "markers_3d")
    work.write(motion, work.output.motion, "motion")

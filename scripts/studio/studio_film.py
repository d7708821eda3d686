"""Film one take from all cameras, and save the true positions of its markers."""

from cospeech.geometry import camera
from cospeech.studio import take
from cospeech.workflow import job

with job.run(snakemake) as work:
    actor, seed = work.params["actor"], work.params["seed"]
    motion = work.read(work.input.motion, "motion")
    cameras = camera.from_table(work.read(work.input.cameras, "cameras"))
    in_views, in_world = take.shoot(motion, actor, cameras, work.output.films, seed)
    work.write(in_views, work.output.markers_2d, "markers_2d")
    work.write(in_world, work.output.markers_3d, "markers_3d")

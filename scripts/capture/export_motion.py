"""Export the markers and the motion of one record for other programs: TRC, C3D and BVH."""

from cospeech.data import trajectories
from cospeech.formats import bvh, c3d, trc
from cospeech.motion import markers
from cospeech.workflow import job

with job.run(snakemake) as work:
    table = work.read(work.input.markers, "markers_3d")
    held = trajectories.from_table(table, markers.NAMES)
    trc.write(held, work.output.trc)
    c3d.write(held, work.output.c3d)
    bvh.write(work.read(work.input.motion, "motion"), work.output.bvh)

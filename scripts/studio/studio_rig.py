"""Set up the studio's five cameras."""

from cospeech.geometry import camera
from cospeech.studio import rig
from cospeech.workflow import job

with job.run(snakemake) as work:
    cameras = camera.to_table(rig.cameras(work.params["width_px"], work.params["seed"]))
    work.write(cameras.assign(rms_px=float("nan"), n_points=None, footage=None), work.output.cameras, "cameras")

"""Set up the studio's five cameras."""

from cospeech import job
from cospeech.capture import camera
from cospeech.studio import rig

with job.run(snakemake) as work:
    cameras = camera.to_table(rig.cameras(work.params["width_px"], work.params["seed"]))
    work.write(cameras.assign(rms_px=float("nan"), n_points=None, footage=None), work.output.cameras, "cameras")

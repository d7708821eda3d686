"""Set up the studio's stereo camera."""

from pathlib import Path

from cospeech.data import tables
from cospeech.formats import camera_toml
from cospeech.geometry import camera
from cospeech.studio import stereo
from cospeech.workflow import job

with job.run(snakemake) as work:
    pair = stereo.cameras(work.params["width_px"])
    with tables.replacing(work.output.cameras) as path:
        Path(path).write_text(camera_toml.toml(pair), encoding="utf-8")
    truth = camera.to_table(pair).assign(rms_px=float("nan"), n_points=None, footage=None)
    work.write(truth, work.output.truth, "cameras")

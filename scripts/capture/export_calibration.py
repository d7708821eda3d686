"""Export the cameras as a TOML file that Pose2Sim and other programs read."""

from pathlib import Path

from cospeech.data import tables
from cospeech.formats import camera_toml
from cospeech.geometry import camera
from cospeech.workflow import job

with job.run(snakemake) as work:
    cameras = camera.from_table(work.read(work.input.cameras, "cameras"))
    with tables.replacing(work.output.toml) as path:
        Path(path).write_text(camera_toml.toml(cameras, up="z"), encoding="utf-8")

"""The cameras as a TOML file that Pose2Sim and other programs read."""

from pathlib import Path

from cospeech import job, tables
from cospeech.capture import camera, given

with job.run(snakemake) as work:
    cameras = camera.from_table(work.read(work.input.cameras, "cameras"))
    with tables.replacing(work.output.toml) as path:
        Path(path).write_text(given.toml(cameras, up="z"), encoding="utf-8")

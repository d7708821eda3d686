"""A picture that another room made, as an exhibit: frames of a synthesised animation, the rig."""

from pathlib import Path

from cospeech.report import output, pictures
from cospeech.workflow import job

with job.run(snakemake) as work:
    picture = Path(work.input.picture).read_bytes()
    output.save_bytes(pictures.as_svg(picture, work.input.picture).encode(), work.output.svg)
    output.save_bytes(picture, work.output.png)

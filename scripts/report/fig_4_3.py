"""A typical picture of each gesture class."""

from cospeech import job
from cospeech.report import output, pictures, style

with job.run(snakemake) as work:
    style.save(pictures.figure(work.input.picture), work.output.svg, work.output.png)
    output.save_table(work.read(work.input.table, "stills"), work.output.table)

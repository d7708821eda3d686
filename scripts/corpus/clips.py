"""Read the sheet of a user's films; a line that cannot be used is reported and left out."""

from cospeech.corpus import clips
from cospeech.workflow import job

with job.run(snakemake) as work:
    sheet = clips.read(work.input.sheet)
    for note in sheet.notes:
        work.warn(note)
    work.write(sheet.clips, work.output.clips, "clips")
    work.write(sheet.mouths, work.output.mouths, "mouths")

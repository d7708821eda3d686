"""Find the syllables of all records, as a live listener would know them."""

import soundfile

from cospeech.speech import syllables
from cospeech.workflow import job

with job.run(snakemake) as work:
    for record, audio, path in zip(work.params["records"], work.input.audio, work.output.syllables, strict=True):
        found = syllables.find(*soundfile.read(audio))
        table = syllables.table(record, found)
        work.say(f"{record}: {len(table)} syllables, of which {table['f0_hz'].count()} are voiced")
        work.write(table, path, "syllables")

"""Estimate the time offsets between the films of one take and the sound of its record."""

from cospeech.capture.tracking import footage, synchronisation
from cospeech.workflow import job

with job.run(snakemake) as work:
    films = [footage.probe(path) for path in work.input.films]
    table = synchronisation.offsets(films, work.input.get("sound"), work.params["given_s"])
    work.write(table, work.output.offsets, "offsets")
    for row in table.itertuples():
        work.say(f"{row.stream}: offset {row.offset_s:+.3f} s ({row.origin}), skipping {row.skipped_s:.3f} s")

"""How far the films of one take and the sound of its record are out of step."""

from cospeech.capture.tracking import footage, synchronisation
from cospeech.workflow import job

with job.run(snakemake) as work:
    films = [footage.examine(path) for path in work.input.films]
    table = synchronisation.offsets(films, work.input.get("sound"), work.params["given_s"])
    work.write(table, work.output.offsets, "offsets")
    for row in table.itertuples():
        work.say(f"{row.stream}: began {row.offset_s:+.3f} s ({row.origin}); skips {row.skipped_s:.3f} s")

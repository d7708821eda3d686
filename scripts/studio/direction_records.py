"""Collect the answers of all voices, one after the other on one clock, with their events and movements."""

from cospeech.workflow import job

with job.run(snakemake) as work:
    records = work.read(work.input.records, "direction_records")
    records["start_s"] = records["duration_s"].cumsum() - records["duration_s"]
    work.write(records, work.output.records, "direction_records")
    work.write(work.read(work.input.events, "direction_events"), work.output.events, "direction_events")
    work.write(work.read(work.input.movement, "direction_movement"), work.output.movement, "direction_movement")

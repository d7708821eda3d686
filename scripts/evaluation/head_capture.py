"""Errors of the poses of virtual heads that were captured from films."""

from cospeech.evaluation import head_recovery
from cospeech.workflow import job

with job.run(snakemake) as work:
    found = []
    for (record, actor), true, path in zip(
        work.params["actors"].items(), work.input.planted, work.input.found, strict=True
    ):
        errors = head_recovery.captured(work.read(true, "head_pose"), work.read(path, "head_pose"))
        found.append(errors.assign(actor=actor, record=record))
    work.write(found, work.output.errors, "head_capture")

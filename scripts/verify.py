"""Reads every artifact of the run again and names what is damaged."""

from pathlib import Path

from cospeech.errors import UserError
from cospeech.workflow import job, verify

with job.run(snakemake) as work:
    folder = Path("results", work.params["run"])
    found = verify.problems(folder)
    if found:
        raise UserError(f"{len(found)} damaged: {'; '.join(found)}")
    work.say(f"every artifact under {folder} is whole")

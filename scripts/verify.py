"""Compares every file of the run with the manifest and names those that differ."""

from pathlib import Path

from cospeech.errors import UserError
from cospeech.workflow import job, manifest, receipts

with job.run(snakemake) as work:
    results, reports = work.params["results"], work.params["reports"]
    known = receipts.load(results)
    if not known:
        raise UserError(f"{results}: no manifest, as no job has run here; run 'cospeech report' first")
    left_over = set(work.params["left_over"])
    planned = [receipt for receipt in known if receipt.path not in left_over]
    manifest.write_table(results, planned, corpus=work.corpus, config_hash=work.config_hash)
    found = manifest.problems([Path(results), Path(reports)], known, planned)
    for problem in found:
        work.warn(problem)
    if found:
        raise UserError(f"{len(found)} of the files in {results} and {reports} are listed above")
    work.say(f"every artifact in {results} and {reports} is as its job wrote it")

"""A system that moves the head, trained on an actor's records, as a folder that new speech can be given to."""

from pathlib import Path

from cospeech import __version__
from cospeech.motion import head
from cospeech.synthesis.registry import installed
from cospeech.synthesis.session import Session
from cospeech.synthesis.training import head_fold
from cospeech.workflow import job, model_folder

with job.run(snakemake) as work:
    given, records = work.params, work.params["records"]
    heads = work.read_each(records, work.input.heads, "head")
    melodies = work.read_each(records, work.input.melodies, "melody")
    training, _ = head_fold(given["actor"], None, melodies, heads)
    system = installed(work.wildcards.system)
    made = Session(training, given["shared"], given["own"]).tables(system)
    card = given["card"] | {
        "system": system.name,
        "variant": "main",
        "actor": given["actor"],
        "held_out": given["held_out"],
        "records": records,
        "version": __version__,
        "motion_fps": head.frame_rate(next(iter(heads.values()))),
    }
    named = {name: (made[name], schema) for name, schema in system.table_schemas.items()}
    model_folder.write(Path(work.output.folder), card, named, corpus=work.corpus, config_hash=work.config_hash)

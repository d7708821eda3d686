"""One actor's model of the head under another actor's voice, in numbers."""

import pandas as pd

from cospeech.evaluation import head_transplant
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, rows = work.params, []
    heads = work.read_each(given["records"], work.input.heads, "head")
    pairs = zip(given["pairs"], work.input.own, work.input.transplanted, work.input.melodies, strict=True)
    for pair, own_path, made_path, melody_path in pairs:
        tables = {
            (place, kind): work.read(f"{pair[place]}/{kind}_patterns.parquet", "hmm_model")
            for place in ("own_model", "other_model")
            for kind in ("head", "melody")
        }
        voice, model, record = pair["voice_actor"], pair["model_actor"], pair["record"]
        learnt = {
            "own_model": [heads[name] for name in pair["own_records"]],
            "other_model": [heads[name] for name in pair["other_records"]],
        }
        agreed = head_transplant.melody_agreement(
            work.read(melody_path, "melody"), tables["own_model", "melody"], tables["other_model", "melody"]
        )
        moved = [
            ("voice_recorded", voice, heads[record], "own_model", None),
            ("own_model", voice, work.read(own_path, "head"), "own_model", None),
            ("transplant", model, work.read(made_path, "head"), "other_model", agreed),
            ("model_recorded", model, learnt["other_model"][0], "other_model", None),
        ]
        origin = {"record": record, "voice_actor": voice, "system": given["system"], "variant": given["variant"]}
        rows += [
            origin
            | {"source": source, "model_actor": actor, "melody_ami": agreement}
            | head_transplant.row(angles, tables[place, "head"], learnt[place])
            for source, actor, angles, place, agreement in moved
        ]
    work.write(pd.DataFrame(rows), work.output.table, "head_transplant")

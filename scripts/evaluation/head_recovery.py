"""How much of the planted head gestures and pitch movements is found again, by models that left the record out."""

from pathlib import Path

from cospeech.evaluation import head_recovery
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, rows = work.params, []
    truth = Path(work.input.planted).parent  # one of the tables that a job plants stands for all of them
    planted = {kind: work.read(str(truth / f"{kind}_patterns.parquet"), "segments") for kind in ("head", "melody")}
    joints = work.read(str(truth / "head_joints.parquet"), "head_joints")
    found = {"head": {}, "melody": {}}
    for record, heads, melodies in zip(given["actors"], work.input.heads, work.input.melodies, strict=True):
        models = {
            kind: work.read(f"{given['models']}/{record}/{kind}_patterns.parquet", "hmm_model") for kind in found
        }
        own = head_recovery.head_segments(models["head"], record, work.read(heads, "head"))
        spoken = head_recovery.melody_segments(models["melody"], record, work.read(melodies, "melody"))
        found["head"][record], found["melody"][record] = own, spoken
        for kind, table in (("head", own), ("melody", spoken)):
            true = planted[kind][planted[kind]["record"] == record]
            agreed = head_recovery.agreement(f"{kind}_ami", true, table)
            rows += [row | {"actor": given["actors"][record], "record": record} for row in agreed]
    for actor in dict.fromkeys(given["actors"].values()):
        records = [record for record, other in given["actors"].items() if other == actor]
        true = {
            kind: {record: table[table["record"] == record] for record in records} for kind, table in planted.items()
        }
        own = {kind: {record: tables[record] for record in records} for kind, tables in found.items()}
        curves = head_recovery.lags("planted", true["head"], true["melody"])[:-1]  # its lag is known
        curves += head_recovery.lags("found", own["head"], own["melody"])
        curves += head_recovery.planted_lag(joints[joints["record"].isin(records)])
        rows += [row | {"actor": actor} for row in curves]
    work.write(head_recovery.table(rows), work.output.recovery, "head_recovery")

"""Measure which accents and keywords coincide with gestures of head and hands."""

from cospeech.evaluation import co_occurrence
from cospeech.evaluation.co_occurrence import Settings
from cospeech.workflow import job

with job.run(snakemake) as work:
    records = work.read(work.input.records, "direction_records")
    events = work.read(work.input.events, "direction_events")
    settings = Settings(work.params["shifts"], work.params["level"])
    accents = (events["tier"] == "syllable") & (events["label"] == "accent")
    keywords = (events["tier"] == "word") & events["label"].isin(work.params["keywords"])
    duration_s = float(records["duration_s"].sum())
    tables, pairs = [], []
    for speech, gestures, chosen in (("accents", "head", accents), ("keywords", "hand", keywords)):
        said = co_occurrence.on_one_clock(events[chosen], records)
        moved = co_occurrence.on_one_clock(events[events["tier"] == gestures], records)
        tables.append(co_occurrence.table(speech, gestures, said, moved, duration_s, settings, work.params["seed"]))
        pairs.append(co_occurrence.pairs(speech, gestures, said, moved, duration_s))
    work.write(tables, work.output.co_occurrence, "co_occurrence")
    work.write(pairs, work.output.pairs, "co_occurrence_pairs")

"""Read one record: check its files, retarget its motion to our skeleton, trim all that it brings to one duration."""

from cospeech.corpus import intake
from cospeech.corpus.head_angles import HeadConventions
from cospeech.corpus.retarget import MotionConventions
from cospeech.formats import sound
from cospeech.workflow import job

with job.run(snakemake) as work:
    entry = work.params["record"]
    skipped_s = 0.0
    if work.input.get("offsets"):
        offsets = work.read(work.input.offsets, "offsets").set_index("stream")
        skipped_s = float(offsets.loc["sound", "skipped_s"])
    record = intake.read_record(
        entry,
        work.input.get("motion") or entry["motion"],  # the studio's own tables lie in a folder, which is the input
        skipped_s,
        MotionConventions(**work.params["motion"]),
        work.params["labels"],
        work.params["frame_s"],
        work.params["length_tolerance_s"],
        work.input.get("head") or entry["head"],
        HeadConventions(**work.params["head"]),
    )
    name, duration_s = entry["record"], record.row["duration_s"].iloc[0]
    work.say(f"{name}: {duration_s:.3f} s; {record.row['note'].iloc[0] or 'as delivered'}")
    if work.output.get("audio"):
        sound.write(record.voice, work.output.audio)
    tables = {
        "motion": (record.body, "motion"),
        "gestures": (record.body, "segments"),
        "prosody": (record.voice, "prosody"),
        "syllables": (record.syllables, "syllables"),
        "melody": (record.melody, "melody"),
        "head": (record.head, "head"),
    }
    for kind, (table, schema) in tables.items():
        if work.output.get(kind):
            work.write(table, work.output[kind], schema)
    work.write(record.row, work.output.record, "records")

"""Read one record: check its files, retarget its motion to our skeleton, trim motion and speech to one duration."""

from cospeech.corpus import intake
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
        work.input.get("motion") or entry["motion"],  # the studio's own lies in a folder, which is the input
        skipped_s,
        MotionConventions(**work.params["motion"]),
        work.params["labels"],
        work.params["frame_s"],
        work.params["length_tolerance_s"],
    )
    name, duration_s = entry["record"], record.row["duration_s"].iloc[0]
    work.say(f"{name}: {duration_s:.3f} s; {record.row['note'].iloc[0] or 'as delivered'}")
    if work.output.get("motion"):
        work.write(record.body, work.output.motion, "motion")
    else:
        work.write(record.body, work.output.gestures, "segments")
    if work.output.get("audio"):
        sound.write(record.voice, work.output.audio)
    else:
        work.write(record.voice, work.output.prosody, "prosody")
    if record.syllables is not None:
        work.write(record.syllables, work.output.syllables, "syllables")
    work.write(record.row, work.output.record, "records")

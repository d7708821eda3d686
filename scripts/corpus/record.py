"""One record enters: its files read, checked against each other and brought to our skeleton, rate and length."""

from cospeech.corpus import intake
from cospeech.corpus.retarget import Declaration
from cospeech.formats import sound
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params["record"]
    late_s = 0.0
    if work.input.get("offsets"):
        skipped = work.read(work.input.offsets, "offsets").set_index("stream")["skipped_s"]
        late_s = float(skipped["sound"])
    taken = intake.take(
        given,
        work.input.get("motion"),
        late_s,
        Declaration(**work.params["motion"]),
        work.params["labels"],
        work.params["frame_s"],
        work.params["length_tolerance_s"],
    )
    name, duration_s = given["record"], taken.row["duration_s"].iloc[0]
    work.say(f"{name}: {duration_s:.3f} s; {taken.row['note'].iloc[0] or 'as delivered'}")
    if work.output.get("motion"):
        work.write(taken.body, work.output.motion, "motion")
    else:
        work.write(taken.body, work.output.gestures, "segments")
    if work.output.get("audio"):
        sound.write(taken.voice, work.output.audio)
    else:
        work.write(taken.voice, work.output.prosody, "prosody")
    work.write(taken.row, work.output.record, "records")

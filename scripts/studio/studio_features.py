"""Simulate the prosody features and gesture phrases of one record, without sound or motion."""

from cospeech.studio import features, voice
from cospeech.workflow import job

with job.run(snakemake) as work:
    record = work.wildcards.record
    gestures = work.read(work.input.gesture_phrases, "segments").query("record == @record")
    prosody = work.read(work.input.prosody_phrases, "segments").query("record == @record")
    table = features.features(
        record,
        prosody,
        voice.base_hz(work.params["voice"]),
        work.params["frame_s"],
        work.params["voiced_gain"],
        work.params["seed"],
    )
    work.write(table, work.output.prosody, "prosody")
    work.write(gestures, work.output.gestures, "segments")

"""Simulate the prosody features and gesture phrases of an actor's records, without sound or motion."""

from cospeech.studio import features, voice
from cospeech.workflow import job

with job.run(snakemake) as work:
    gestures = work.read(work.input.gesture_phrases, "segments").groupby("record")
    prosody = work.read(work.input.prosody_phrases, "segments").groupby("record")
    base_hz = voice.base_hz(work.params["voice"])
    for record in work.params["records"]:
        table = features.features(
            record,
            prosody.get_group(record),
            base_hz,
            work.params["frame_s"],
            work.params["voiced_gain"],
            work.params["seed"],
        )
        work.write(table, f"{work.output.features}/{record}.prosody.parquet", "prosody")
        work.write(gestures.get_group(record), f"{work.output.features}/{record}.gestures.parquet", "segments")

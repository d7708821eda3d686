"""Simulate what an actor's records would give without sound: prosody, syllables, gesture phrases, and motion."""

from cospeech.motion import head
from cospeech.studio import features, motion, performance, scenes, voice
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, seed = work.params, work.params["seed"]
    planted = {name: work.read(work.input[name], scenes.TABLES[name][1]) for name in given["planted"]}
    base_hz = voice.base_hz(given["voice"])
    for record in given["records"]:
        scene = scenes.of_record(planted, record)
        speech = features.speech(record, scene, base_hz, given["frame_s"], given["voiced_gain"], seed)
        raw = f"{work.output.features}/{record}"
        work.write(speech.prosody, f"{raw}.prosody.parquet", "prosody")
        work.write(speech.syllables, f"{raw}.syllables.parquet", "syllables")
        if scene.heads is not None:
            angles = performance.head_angles(given["actor"], scene, given["head_fps"], seed)
            work.write(features.melody(record, scene, base_hz, seed), f"{raw}.melody.parquet", "melody")
            work.write(head.table(angles, given["head_fps"]), f"{raw}.head.parquet", "head")
        if given["motion_fps"] is None:
            work.write(scene.gestures, f"{raw}.gestures.parquet", "segments")
        else:
            moved = performance.perform(given["actor"], record, scene, given["motion_fps"], seed)
            captured = motion.with_sensor_noise(moved, given["motion_noise_deg"], record, seed)
            work.write(captured, f"{raw}.motion.parquet", "motion")

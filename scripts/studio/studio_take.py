"""Record one take in which the actor follows the script: sound, captured motion, and the ground truth of both."""

import soundfile

from cospeech.data import tables
from cospeech.formats import bvh
from cospeech.studio import motion, voice
from cospeech.workflow import job

with job.run(snakemake) as work:
    record, seed = work.wildcards.record, work.params["seed"]
    gestures = work.read(work.input.gesture_phrases, "segments").query("record == @record")
    prosody = work.read(work.input.prosody_phrases, "segments").query("record == @record")
    sound, planted = voice.speak(
        record, prosody, work.params["voice"], work.params["scenario"], work.params["frame_s"], seed
    )
    moved = motion.perform(work.params["actor"], record, gestures, prosody, work.params["motion_fps"], seed)
    with tables.replacing(work.output.sound) as path:
        soundfile.write(path, sound, voice.RATE_HZ, subtype="PCM_16", format="WAV")
    bvh.write(motion.with_sensor_noise(moved, work.params["motion_noise_deg"], record, seed), work.output.bvh)
    work.write(moved, work.output.motion, "motion")
    work.write(planted, work.output.prosody, "planted_prosody")

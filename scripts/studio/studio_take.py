"""Record one take in which the actor follows the script: sound, captured motion, and the ground truth of both."""

import soundfile

from cospeech.data import tables
from cospeech.formats import bvh
from cospeech.motion import head
from cospeech.studio import motion, performance, scenes, talking, voice
from cospeech.workflow import job

with job.run(snakemake) as work:
    record, seed, fps = work.wildcards.record, work.params["seed"], work.params["motion_fps"]
    planted = {name: work.read(work.input[name], scenes.TABLES[name][1]) for name in work.params["planted"]}
    scene = scenes.of_record(planted, record)
    sound, prosody = voice.speak(
        record,
        scene.prosody,
        work.params["voice"],
        work.params["scenario"],
        work.params["frame_s"],
        seed,
        scene.delivery(),
    )
    moved = performance.perform(work.params["actor"], record, scene, fps, seed)
    with tables.replacing(work.output.sound) as path:
        soundfile.write(path, sound, voice.RATE_HZ, subtype="PCM_16", format="WAV")
    bvh.write(motion.with_sensor_noise(moved, work.params["motion_noise_deg"], record, seed), work.output.bvh)
    work.write(moved, work.output.motion, "motion")
    work.write(prosody, work.output.prosody, "planted_prosody")
    if work.params["heads"]:
        work.write(talking.poses(head.angles(moved), fps, record, seed), work.output.head, "head_pose")

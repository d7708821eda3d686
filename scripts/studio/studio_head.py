"""Film the head of a speaking actor with both cameras of a stereo pair."""

import soundfile

from cospeech.geometry import camera
from cospeech.motion import head
from cospeech.studio import face, take, talking
from cospeech.workflow import job

with job.run(snakemake) as work:
    record, actor, seed = work.wildcards.record, work.params["actor"], work.params["seed"]
    poses = work.read(work.input.poses, "head_pose")
    pair = camera.from_table(work.read(work.input.cameras, "cameras"))
    samples, rate_hz = soundfile.read(work.input.sound)
    acting = talking.acting(poses, samples, rate_hz, record, seed)
    take.shoot_head(acting, face.appearance(actor, seed), pair, work.output.films, head.frame_rate(poses), seed)

"""Track the pose of the head of one record in the films of its face."""

from cospeech.capture.head import films, track
from cospeech.workflow import job

with job.run(snakemake) as work:
    settings, paths = work.params["settings"], list(work.input.films)
    cameras = films.cameras(paths, work.input.get("cameras") or None, **work.params["focal_length"])
    found = track.track(
        films.probed(paths), cameras, settings, work.params["most_frames_apart"], work.wildcards.record
    )
    work.write(found.table, work.output.pose, "head_pose")
    for line in found.notes:
        work.warn(line)

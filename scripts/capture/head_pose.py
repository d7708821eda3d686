"""Track the pose of the head of one record in the film of its face."""

from cospeech.capture.head import films, track
from cospeech.workflow import job

with job.run(snakemake) as work:
    settings, record = work.params["settings"], work.wildcards.record
    calibration = work.input.get("cameras")
    if calibration and calibration.endswith(".toml"):
        known = films.cameras_of_file(calibration, work.input.films)
    elif calibration:
        known = films.cameras_of_table(work.read(calibration, "cameras"), work.input.films)
    else:
        known = [films.camera_of_focal_length(work.input.films[0], settings["focal_px"])]
    found = track.track(films.probed(work.input.films), known, settings, work.params["most_frames_apart"], record)
    work.write(found.table, work.output.pose, "head_pose")
    for line in found.notes:
        work.warn(line)

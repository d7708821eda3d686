"""Track the markers of one take in every view and in 3D."""

from cospeech.capture.calibration import fingerprint
from cospeech.capture.tracking import clicks, detections, footage, quality_sheet, track
from cospeech.geometry import camera
from cospeech.workflow import job

with job.run(snakemake) as work:
    settings = work.params["settings"]
    rig = work.read(work.input.cameras, "cameras")
    fingerprint.check(dict(zip(rig["camera"], rig["footage"], strict=True)), work.input.calibration)
    began = work.read(work.input.offsets, "offsets") if work.input.get("offsets") else None
    films, cameras = footage.open_take(work.input.films, began, camera.from_table(rig))
    n_frames = footage.check(films, cameras, settings["most_frames_apart"])
    found = track.track_markers(
        films,
        cameras,
        settings["method"],
        n_frames,
        clicked=clicks.read(work.input.clicks[0], cameras, n_frames) if work.input.get("clicks") else None,
        corrections=clicks.read(work.input.corrections[0], cameras, n_frames)
        if work.input.get("corrections")
        else None,
        where=work.wildcards.take,
    )
    world = detections.world_table(found, films[0].fps, settings["longest_hidden_s"])
    work.write(detections.view_table(found, world, cameras), work.output.views, "markers_2d")
    work.write(world, work.output.world, "markers_3d")
    spans = quality_sheet.spans(world)
    work.write(spans, work.output.spans, "marker_spans")
    for line in quality_sheet.summary(world):
        work.say(line)

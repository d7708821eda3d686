"""List the worst moments of the tracking of one record, with an image of each in every view."""

from cospeech.capture.tracking import footage, overlay, quality_sheet
from cospeech.formats import canvas
from cospeech.geometry import camera
from cospeech.workflow import job

with job.run(snakemake) as work:
    began = work.read(work.input.offsets, "offsets") if work.input.get("offsets") else None
    rig = camera.from_table(work.read(work.input.cameras, "cameras"))
    films, cameras = footage.open_take(work.input.films, began, rig)
    views, world = work.read(work.input.views, "markers_2d"), work.read(work.input.world, "markers_3d")
    table = quality_sheet.in_views(quality_sheet.worst_moments(world, len(work.output.pictures)), views)
    work.write(table, work.output.table, "worst_moments")
    pictures = overlay.moments(table, films, cameras, views, world)
    for picture, path in zip(pictures, work.output.pictures, strict=True):
        canvas.save(picture, path)

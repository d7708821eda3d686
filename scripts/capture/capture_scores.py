"""Score the capture of every record against the ground truth of the virtual studio."""

from cospeech.capture import accuracy
from cospeech.capture.fitting import skeleton_fit
from cospeech.geometry import camera
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params
    found = work.read(work.input.cameras, "cameras")
    true = camera.from_table(work.read(work.input.true_cameras, "cameras"))
    spots = work.read(work.input.spots, "laser")
    to_planted, rows = accuracy.calibration(found, camera.from_table(found), true, spots)
    planted = {
        record: (work.read(views, "markers_2d"), work.read(world, "markers_3d"))
        for record, views, world in zip(given["records"], work.input.true_views, work.input.true_world, strict=True)
    }
    tracked = {}
    for (record, method), views, world in zip(given["tracked"], work.input.views, work.input.world, strict=True):
        tracked[record, method] = work.read(world, "markers_3d")
        own = accuracy.tracking(
            work.read(views, "markers_2d"), tracked[record, method], *planted[record], true, to_planted
        )
        rows += [row | {"record": record, "method": method} for row in own]
    for record, take, motion, true_motion in zip(
        given["records"], work.input.takes, work.input.motion, work.input.true_motion, strict=True
    ):
        model = skeleton_fit.fit_body_model(work.read(take, "markers_3d"), given["static_s"])
        found = work.read(motion, "motion"), tracked[record, given["method"]]
        own = accuracy.angles(*found, work.read(true_motion, "motion"), planted[record][1], model, to_planted)
        rows += [row | {"record": record, "method": given["method"]} for row in own]
    work.write(accuracy.table(rows), work.output.scores, "capture_scores")
    for row in rows:
        work.say(f"{row.get('record', 'rig')} {row.get('method', '')} {row['quantity']}: {row['value']:.4g}")

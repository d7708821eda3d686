"""The cameras of the rig, from the laser spots that they saw together and from where they are stated to be."""

from cospeech import job, tables
from cospeech.capture import axes, camera, fingerprint, laser, quality, rig_picture, selfcalibrate

with job.run(snakemake) as work:
    rig = camera.from_table(work.read(work.input.rig, "cameras"))
    names = [view.name for view in rig]
    observations, _ = laser.observations(work.read(work.input.laser, "laser"), names)
    sizes_px = [view.size_px for view in rig]
    found, points, used = selfcalibrate.calibrate(names, observations, sizes_px, work.params["seed"])
    trust = quality.table(found, points, used, observations)
    for row in trust.itertuples():
        work.say(f"{row.camera}: {row.rms_px:.3f} px over {row.n_points} points, {row.coverage:.0%} of the picture")
    change = axes.by_places(found, {view.name: view.place_m for view in rig})
    placed = change.cameras(found)
    table = camera.to_table(placed).merge(trust[["camera", "rms_px", "n_points"]], on="camera", validate="1:1")
    work.write(table, work.output.cameras, "cameras")
    trust["footage"] = [fingerprint.of(path) for path in work.input.films]
    work.write(trust, work.output.quality, "calibration_quality")
    with tables.replacing(work.output.picture) as path:
        rig_picture.save(rig_picture.draw(placed, change.points(points)), path)

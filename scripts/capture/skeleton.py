"""Fit the joint angles of one record to its markers, with the body model from the actor's range-of-motion take."""

from cospeech.capture.fitting import marker_file, skeleton_fit
from cospeech.workflow import job

with job.run(snakemake) as work:
    take = work.read(work.input.take, "markers_3d")
    record = work.read(work.input.markers, "markers_3d")
    file, declared = work.params["file"], work.params["markers"]
    if file:
        marker_file.check(record, declared["up"], declared["facing"], file)
    found = skeleton_fit.fit(take, record, work.params["static_s"], work.params["static"])
    work.write(found.motion, work.output.motion, "motion")
    work.write(found.observability, work.output.observability, "observability")
    work.say(f"{work.wildcards.record}: {found.line}")

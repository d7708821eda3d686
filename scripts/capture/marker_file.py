"""Import the markers of one take from the file of another system, with our names and axes."""

from cospeech.capture.fitting import marker_file
from cospeech.capture.tracking import quality_sheet
from cospeech.motion import markers
from cospeech.workflow import job

with job.run(snakemake) as work:
    declared = work.params["markers"]
    mapped = declared["names"]
    names = {name: name for name in markers.NAMES} if mapped == "cospeech" else mapped
    world = marker_file.read(
        work.input.file,
        names,
        declared["up"],
        declared["facing"],
        work.params["longest_hidden_s"],
        static=(declared["static"], work.params["static_s"]) if work.params["static_s"] else None,
    )
    work.write(world, work.output.world, "markers_3d")
    work.write(quality_sheet.spans(world), work.output.spans, "marker_spans")
    for line in quality_sheet.summary(world):
        work.say(line)

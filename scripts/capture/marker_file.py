"""The markers of one take from the file of another system, under our names and axes."""

from cospeech import job, markers
from cospeech.capture import marker_file, quality_sheet

with job.run(snakemake) as work:
    declared = work.params["markers"]
    given = declared["names"]
    names = {name: name for name in markers.NAMES} if given == "cospeech" else given
    world = marker_file.read(
        work.input.file, names, declared["up"], declared["facing"], work.params["longest_hidden_s"]
    )
    work.write(world, work.output.world, "markers_3d")
    work.write(quality_sheet.spans(world), work.output.spans, "marker_spans")
    for line in quality_sheet.summary(world):
        work.say(line)

"""One record from its speech to its gestures."""

from cospeech.report import output, style, timeline
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params
    record = given["record"]
    clusters = work.read(work.input.clusters, "segments")
    sequences = {"actual": work.read(work.input.actual[0], "segments")}
    for system, path in zip(given["systems"], work.input.synthesised, strict=True):
        sequences[given["titles"][system]] = work.read(path, "segments")
    table = timeline.strips(clusters[clusters["record"] == record], sequences)
    prosody = work.read(work.input.prosody, "prosody")
    figure = timeline.figure(prosody, table, given["labels"], given["voiced_gain"])
    style.save(figure, work.output.svg, work.output.png)
    output.save_table(table, work.output.table)

"""The quality sheet of one filmed record, a file that refers to its video."""

import os
from pathlib import Path

from cospeech.report import output, quality, style
from cospeech.report.page import rendering, svg, videos
from cospeech.workflow import job

with job.run(snakemake) as work:
    world = work.read(work.input.world, "markers_3d")
    spans = work.read(work.input.spans, "marker_spans")
    pictures = [videos.data_uri(Path(path).read_bytes(), "image/png") for path in work.input.pictures]
    record = work.wildcards.record
    content = {
        "record": record,
        "corpus": work.corpus,
        "timeline": svg.inline(style.as_svg(quality.timeline(world)), "timeline", "Status of each marker"),
        "markers": quality.marker_table(world),
        "spans": quality.span_table(spans),
        "n_spans": len(spans),
        "cameras": quality.camera_table(work.read(work.input.calibration, "calibration_quality")),
        "moments": quality.moments(work.read(work.input.moments, "worst_moments"), pictures),
        "overlay": os.path.relpath(work.input.overlay, Path(work.output.sheet).parent),
        "corrections": work.params["corrections"],
    }
    output.save_bytes(rendering.render(work.input.template, **content).encode(), work.output.sheet)

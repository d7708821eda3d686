"""The page of a run about route directions."""

from pathlib import Path

from cospeech.report import output
from cospeech.report.exhibits import drawing
from cospeech.report.exhibits.run import Run
from cospeech.report.page import directions, rendering, sections
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params
    run = Run.of(given, work.input.published)
    tables = {name: drawing.read(work, name, run) for name in given["sources"]}
    files, captions = (
        {Path(path).name: path for path in paths} for paths in (work.input.exhibits, work.input.captions)
    )
    shown = sections.show(run, drawing.named(given["exhibits"]), files, captions)
    says = directions.content(run, given["config"], tables, shown) | {
        "absent": [],
        "failed": [],
        "config_hash": job.settings_hash({"config": given["config"]}),
    }
    page = rendering.render_with_videos(work.input.template, says, [])
    output.save_bytes(page.encode(), work.output.page)

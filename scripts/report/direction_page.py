"""The page of a run about route directions."""

from cospeech.report import output
from cospeech.report.page import directions, inputs, rendering
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params
    run, tables, shown = inputs.read(work)
    says = directions.content(run, given["config"], tables, shown) | {
        "absent": [],
        "failed": [],
        "config_hash": job.settings_hash({"config": given["config"]}),
    }
    page = rendering.render_with_videos(work.input.template, says, [])
    output.save_bytes(page.encode(), work.output.page)

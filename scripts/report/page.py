"""The page: everything of the run in one file that needs nothing else."""

from pathlib import Path

from cospeech.report import output
from cospeech.report.page import content, inputs, rendering, videos
from cospeech.viewer import page as viewer_page
from cospeech.workflow import job

MOST_VIEWER_BYTES = 14_000_000
"""Bytes of the page for records in the 3D viewer; further ones are loaded from next to it."""


def viewer(titles, paths, labels):
    """What the page needs for the 3D viewer; None without a record to show."""
    if not paths:
        return None
    scripts = {title: Path(path).read_text(encoding="utf-8") for title, path in zip(titles, paths, strict=True)}
    return viewer_page.embedded(scripts, [f"viewer/{Path(path).name}" for path in paths], labels, MOST_VIEWER_BYTES)


with job.run(snakemake) as work:
    given = work.params
    run, tables, shown = inputs.read(work)
    clips = [videos.Clip(path, **clip) for path, clip in zip(work.input.videos, given["clips"], strict=True)]
    says = content.content(run, given["config"], tables, shown) | {
        "absent": given["absent"],
        "failed": [*given["failed"], *content.failures(tables.get("decoding", {}))],
        "config_hash": job.settings_hash({"config": given["config"]}),
    }
    says["viewer"] = viewer(given["viewer"], work.input.viewer, given["config"]["phrases"]["gesture"]["labels"])
    page = rendering.render_with_videos(work.input.template, says, clips)
    output.save_bytes(page.encode(), work.output.page)

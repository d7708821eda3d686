"""The page: everything of the run in one file that needs nothing else."""

from pathlib import Path

import pandas as pd
import yaml

from cospeech.report import captions, findings, leaderboard, output, page, provenance, published, videos
from cospeech.workflow import job

MOST_BYTES = 25_000_000

with job.run(snakemake) as work:
    given, config, systems = work.params, work.params["config"], work.params["systems"]
    printed = yaml.safe_load(Path(work.input.published).read_text(encoding="utf-8"))
    records = work.read(work.input.records, "records")
    annotations = work.read(work.input.annotations, "annotations")
    statistics = work.read(work.input.statistics[0], "motion_statistics") if work.input.statistics else None
    cameras = work.read(work.input.cameras[0], "cameras") if work.input.cameras else None
    numbers = dict(zip(given["tables"], map(pd.read_csv, work.input.tables), strict=True))
    pictures = {
        name: Path(path).read_text(encoding="utf-8")
        for name, path in zip(given["figures"], work.input.figures, strict=True)
    }
    titles = {name: system["title"] for name, system in systems.items()}
    exhibits = {}
    for name, path in zip(given["exhibits"], work.input.captions, strict=True):
        pairs = published.pairs(name, printed, numbers[name], titles) if name in numbers else []
        exhibits[name] = page.exhibit(name, captions.read(path), pictures.get(name), numbers.get(name), pairs)

    board = numbers["leaderboard"]
    heads, whole = page.leaderboard(board, systems, "whole")
    _, interior = page.leaderboard(board, systems, "interior")
    found = findings.findings(
        leaderboard.at_main(work.read(work.input.scores, "session_scores"), given["clusters"], given["states"]),
        work.read(work.input.differences, "differences"),
        systems,
        numbers.get("fig-recovery"),
        numbers.get("fig-motion"),
        numbers.get("table-capture"),
    )
    content = {
        "title": given["title"],
        "banner": provenance.banner(config, records, annotations, cameras),
        "findings": found,
        "absent": given["absent"],
        "sections": page.sections(exhibits),
        "boards": {"heads": heads, "whole": whole, "interior": interior, "level": given["level_pct"]},
        "facts": provenance.facts(config, records, statistics),
        "links": given["links"],
        "results": f"results/{given['run']}",
        "sheets": f"reports/{given['run']}/capture",
        "config_hash": job.settings_hash({"config": config}),
        "seed": config["seed"],
    }
    template = work.input.template
    room = MOST_BYTES - len(page.render(template, videos=[], **content).encode())
    shown = videos.embed(
        dict(zip(given["filmed"], work.input.videos, strict=True)), given["video_links"], given["actors"], room
    )
    output.save_bytes(page.render(template, videos=shown, **content).encode(), work.output.page)

"""A made-up run: plausible tables in their places, and the report's own scripts run over them."""

import types

import av
import numpy as np
import plausible
import pytest
import yaml
from PIL import Image

from cospeech.data import tables
from cospeech.evaluation import motion, recovery, sessions
from cospeech.workflow import job

ROOT = plausible.ROOT
MAIN = "clusters~8/states~3"
PICTURED = ["hsmm", "hsmm_weighted"]
STRIPS = [*PICTURED, "hsmm_weighted_shifted", "random"]
TITLES = {name: system["title"] for name, system in plausible.SYSTEMS.items()} | {"actual": "actual"}


class Named(list):
    """What Snakemake gives a script as input, output or params: a list with names."""

    def __init__(self, **names):
        super().__init__(names.values())
        self.__dict__.update(names)

    def items(self):
        return self.__dict__.items()


class Run:
    """A folder with the results of a run, and a way to run scripts in it."""

    def __init__(self, folder):
        self.results, self.reports = folder / "results/made_up", folder / "reports/made_up"

    def write(self, table, path, schema):
        tables.write(table, self.results / path, schema, corpus="virtual", config_hash="0")

    def path(self, name):
        return str(self.results / name)

    def script(self, name, exhibit=None, input=None, output=None, **params):
        """Run scripts/report/<name>.py as Snakemake would."""
        if exhibit is not None:
            output = {kind: str(self.reports / f"figures/{exhibit}.{kind}") for kind in ("svg", "png")}
            output["table"] = str(self.reports / f"tables/{exhibit}.csv")
        given = types.SimpleNamespace(
            input=Named(**input),
            output=Named(**output),
            params=Named(**params, corpus="virtual", code="0"),
            wildcards=Named(),
            rule=name,
            log=[str(self.results / f"logs/{name}.log")],
        )
        text = (ROOT / f"scripts/report/{name}.py").read_text(encoding="utf-8")
        exec(compile(text, f"{name}.py", "exec"), {"snakemake": given})


@pytest.fixture(autouse=True, scope="session")
def raising():
    """A script that fails raises here, where it would end its process."""

    def stop(message):
        raise AssertionError(message)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(job, "_stop", stop)
        yield


def film(path):
    path.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(path), "w") as video:
        stream = video.add_stream("libx264", rate=10)
        stream.width, stream.height, stream.pix_fmt = 96, 64, "yuv420p"
        for k in range(10):
            picture = np.full((64, 96, 3), 20 * k, dtype=np.uint8)
            video.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        video.mux(stream.encode())


@pytest.fixture(scope="session")
def tables_of_a_run(tmp_path_factory):
    """The tables and pictures that a run leaves for its report."""
    run = Run(tmp_path_factory.mktemp("report"))
    actual = plausible.actual_phrases()
    for record, table in actual.items():
        rng = np.random.default_rng(3)
        run.write(table, f"phrases/gesture/{record}.parquet", "segments")
        run.write(plausible.speech(record, rng), f"speech/{record}/prosody.parquet", "prosody")
        film(run.results / f"animation/{record}/comparison.mp4")
    for (system, record), table in plausible.synthesised_phrases(actual).items():
        if system in STRIPS:
            run.write(table, f"synthesis/{system}/{MAIN}/{record}/phrases.parquet", "segments")
    run.write(plausible.clusters("ada_1", np.random.default_rng(1)), "phrases/prosody/ada_1.parquet", "segments")
    run.write(plausible.records(), "corpus/records.parquet", "records")
    run.write(plausible.annotations(), "corpus/annotations.parquet", "annotations")
    scores = plausible.record_scores()
    run.write(
        sessions.session_scores(scores, plausible.BOOTSTRAP), "evaluation/session_scores.parquet", "session_scores"
    )
    run.write(
        sessions.differences(scores, 8, 3, plausible.BOOTSTRAP), "evaluation/differences.parquet", "differences"
    )
    motions = {}
    for place, system in enumerate((motion.ORIGINAL, *PICTURED, "random")):
        for number, record in enumerate(plausible.ACTORS):
            rng = np.random.default_rng([place, number])
            motions[system, record] = plausible.motion(record, 1 - 0.1 * place, rng)
    statistics, histograms = motion.statistics(motions, plausible.ACTORS, 40)
    run.write(statistics, "evaluation/motion_statistics.parquet", "motion_statistics")
    run.write(histograms, "evaluation/motion_histograms.parquet", "motion_histograms")
    run.write(recovery.table(plausible.recovery_rows()), "evaluation/recovery.parquet", "recovery")
    run.write(plausible.smoothing(), "animation/smoothing.parquet", "smoothing_trial")
    run.write(plausible.stills(), "animation/stills.parquet", "stills")
    run.write(plausible.cameras(), "capture/cameras.parquet", "cameras")
    run.write(plausible.capture_scores(), "capture/capture_scores.parquet", "capture_scores")
    run.write(plausible.film_effect(), "evaluation/film_effect.parquet", "film_effect")
    run.write(plausible.observability(), "capture/observability.parquet", "observability")
    for name in ("stills", "strip"):
        Image.new("RGB", (640, 240), (180, 190, 200)).save(run.results / f"animation/{name}.png")
    return run


@pytest.fixture(scope="session")
def exhibits(tables_of_a_run):
    """The run with every exhibit drawn."""
    run, labels = tables_of_a_run, list(plausible.GESTURES)
    draw_exhibits(run, labels)
    return run


def draw_exhibits(run, labels):
    def of(system, records):
        return [run.path(f"synthesis/{system}/{MAIN}/{record}/phrases.parquet") for record in records]

    def actual(records):
        return [run.path(f"phrases/gesture/{record}.parquet") for record in records]

    def table(name):
        return {"table": str(run.reports / f"tables/{name}.csv")}

    actors, records = plausible.ACTORS, list(plausible.ACTORS)
    scores = {"scores": run.path("evaluation/session_scores.parquet")}
    shared = {"titles": TITLES, "labels": labels}
    run.script(
        "table_3_scenarios", input={"records": run.path("corpus/records.parquet")}, output=table("table-3-scenarios")
    )
    run.script(
        "table_4_1", input={"phrases": actual(records)}, output=table("table-4.1"), actors=actors, labels=labels
    )
    run.script(
        "fig_timeline", "fig-timeline",
        {"prosody": run.path("speech/ada_1/prosody.parquet"), "clusters": run.path("phrases/prosody/ada_1.parquet"),
         "actual": actual(["ada_1"]), "synthesised": [path for system in STRIPS for path in of(system, ["ada_1"])]},
        record="ada_1", systems=STRIPS, voiced_gain=0.4, **shared,
    )  # fmt: skip
    setting = {"clusters": 8, "states": 3}
    run.script("leaderboard", "leaderboard", scores, systems=plausible.SYSTEMS, **setting)
    run.script(
        "fig_differences", "fig-differences", {"differences": run.path("evaluation/differences.parquet")},
        systems=plausible.SYSTEMS, bin_s=0.5, measures=["kappa", "D", "boundary_f1", "S"],
    )  # fmt: skip
    for figure, axis in (("fig-7.2a", "clusters"), ("fig-7.2b", "states")):
        published = {"published": str(ROOT / "reports/template/published.yaml")}
        run.script("fig_7_2", figure, scores | published, axis=axis, systems=PICTURED, titles=TITLES, **setting)
    for figure, own in (("fig-7.3", records[:4]), ("fig-7.4", records[4:])):
        made = [path for system in PICTURED for path in of(system, own)]
        run.script("fig_7_3", figure, {"actual": actual(own), "synthesised": made}, systems=PICTURED, bin_s=0.25,
                   max_duration_s=10.0, **shared)  # fmt: skip
    made = [path for system in PICTURED for path in of(system, records)]
    sequences = {"actual": actual(records), "synthesised": made}
    run.script("fig_7_5", "fig-7.5", sequences, systems=PICTURED, actors=actors, **shared)
    stills = {"picture": run.path("animation/stills.png"), "table": run.path("animation/stills.parquet")}
    run.script("fig_4_3", "fig-4.3", stills)
    run.script("fig_6_3", "fig-6.3", {"trial": run.path("animation/smoothing.parquet")})
    run.script("picture", "fig-6.4", {"picture": run.path("animation/strip.png")})
    moved = {name: run.path(f"evaluation/motion_{name}.parquet") for name in ("statistics", "histograms")}
    run.script("fig_motion", "fig-motion", moved, titles=TITLES | {"original": "original"})
    run.script("picture", "fig-rig", {"picture": run.path("animation/strip.png")})
    captured = {
        "scores": run.path("capture/capture_scores.parquet"),
        "effect": run.path("evaluation/film_effect.parquet"),
    }
    run.script(
        "table_capture", input=captured, output=table("table-capture"), width_px=696, method="robust", bin_s=0.5
    )
    told = {"tables": [run.path("capture/observability.parquet")] * 2}
    run.script("table_observability", input=told, output=table("table-observability"))
    run.script("fig_recovery", "fig-recovery", {"recovery": run.path("evaluation/recovery.parquet")}, **setting)


PLAIN = ["fig-timeline", "leaderboard", "fig-differences", "fig-7.3", "fig-7.5", "fig-7.2a", "fig-7.2b", "fig-7.4"]
CAPTURED = ["table-capture", "table-observability"]
MOVING = ["fig-4.3", "fig-6.3", "fig-6.4", "fig-motion"]


def make_page(run, name, *, motion=True, planted=True, corpus=None):
    """Render the page of the made-up run, with or without films, motion and planted truth; return its text."""
    config = yaml.safe_load((ROOT / "config/demo.yaml").read_text(encoding="utf-8"))
    config["corpus"] |= corpus or {}
    figures = PLAIN + MOVING * motion + ["fig-recovery", "fig-rig"] * planted
    pictures = ("fig-6.4", "fig-rig")
    csv = ["table-3-scenarios", "table-4.1", *(figure for figure in figures if figure not in pictures)]
    csv += CAPTURED * planted
    shown = list(dict.fromkeys([*csv, *figures]))
    filmed = list(plausible.ACTORS) if motion else []
    evaluation = {name: run.path(f"evaluation/{name}.parquet") for name in ("session_scores", "differences")}
    output = run.reports / name
    run.script(
        "page",
        input={
            "template": str(ROOT / "reports/template/page.html.jinja"),
            "published": str(ROOT / "reports/template/published.yaml"),
            "captions": [str(ROOT / f"reports/template/captions/{exhibit}.rst") for exhibit in shown],
            "figures": [str(run.reports / f"figures/{exhibit}.svg") for exhibit in figures],
            "tables": [str(run.reports / f"tables/{exhibit}.csv") for exhibit in csv],
            "records": run.path("corpus/records.parquet"),
            "annotations": run.path("corpus/annotations.parquet"),
            "scores": evaluation["session_scores"],
            "differences": evaluation["differences"],
            "statistics": [run.path("evaluation/motion_statistics.parquet")] if motion else [],
            "cameras": [run.path("capture/cameras.parquet")] * planted,
            "videos": [run.path(f"animation/{record}/comparison.mp4") for record in filmed],
        },
        output={"page": str(output)},
        title="made up", config=config, systems=plausible.SYSTEMS, actors=plausible.ACTORS, clusters=8, states=3,
        level_pct=95.0, exhibits=shown, figures=figures, tables=csv, absent=[] if motion else ["Videos, as it is."],
        links={
            exhibit: [f"figures/{exhibit}.{kind}" for kind in ("svg", "png") if exhibit in figures]
            + [f"tables/{exhibit}.csv" for _ in range(exhibit in csv)]
            for exhibit in shown
        },
        filmed=filmed,
        video_links={record: f"../../results/made_up/animation/{record}/comparison.mp4" for record in filmed},
        run="made_up",
    )  # fmt: skip
    return output.read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def virtual_page(exhibits):
    return make_page(exhibits, "index.html")


@pytest.fixture(scope="session")
def real_page(exhibits):
    corpus = {"source": "recorded", "name": "beat2"}
    return make_page(exhibits, "real.html", motion=False, planted=False, corpus=corpus)

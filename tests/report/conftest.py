"""A made-up run: plausible tables in their places, and the report's own scripts run over them."""

import types

import av
import numpy as np
import plausible
import plausible_heads
import pytest
import yaml
from PIL import Image

from cospeech.data import tables
from cospeech.evaluation import motion, motion_quality, recovery, sessions
from cospeech.motion import library
from cospeech.motion.body import STANDARD
from cospeech.report import exhibits as exhibits_of_report
from cospeech.report import systems as reported
from cospeech.viewer import page as viewer
from cospeech.viewer import takes
from cospeech.workflow import job

ROOT = plausible.ROOT
TEMPLATE = ROOT / "reports/template"
CONFIG = yaml.safe_load((ROOT / "config/demo.yaml").read_text(encoding="utf-8"))
SHOWN = ["hsmm_weighted"]
PICTURED = reported.pictured(plausible.SYSTEMS, SHOWN)
IN_TIMELINE = reported.in_timeline(plausible.SYSTEMS, SHOWN)
EVERY_CONDITION = [condition.name for condition in exhibits_of_report.CONDITIONS]

NAMES = {
    "record": list(plausible.ACTORS),
    "first_record": ["ada_1"],
    "captured": list(plausible.ACTORS),
    "pictured": [plausible.SYSTEMS[name] for name in PICTURED],
    "in_timeline": [plausible.SYSTEMS[name] for name in IN_TIMELINE],
    "third_party": [],
    "first_head": [plausible_heads.SYSTEMS[plausible_heads.SHOWN[0]]],
    "shown_head": [plausible_heads.SYSTEMS[name] for name in plausible_heads.SHOWN],
    "setting": ["clusters~8/states~3"],
}
ABOUT_RUN = {
    "systems": plausible.PARAMS,
    "actors": plausible.ACTORS,
    "pictured": PICTURED,
    "in_timeline": IN_TIMELINE,
    "main": {"clusters": 8, "states": 3},
    "heads": plausible_heads.PARAMS,
    "shown_heads": plausible_heads.SHOWN,
}


class Named(list):
    """What Snakemake gives a script as input, output or params: a list with names."""

    def __init__(self, *unnamed, **names):
        super().__init__([*unnamed, *names.values()])
        self.__dict__.update(names)

    def __getitem__(self, key):
        return self.__dict__[key] if isinstance(key, str) else super().__getitem__(key)

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

    def sources(self, names):
        """The files of sources, by the name of the source."""
        return {name: [self.path(path) for path in exhibits_of_report.SOURCES[name].paths(NAMES)] for name in names}

    def script(self, name, input, output, **params):
        """Run scripts/report/<name>.py as Snakemake would."""
        given = types.SimpleNamespace(
            input=Named(**input),
            output=output,
            params=Named(**ABOUT_RUN, **params, corpus="virtual", code="0"),
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
        run.write(plausible.observability(), f"capture/{record}/observability.parquet", "observability")
        film(run.results / f"animation/{record}/comparison.mp4")
    film(run.results / "transplant/deniz/ada_1/comparison.mp4")
    for (system, record), table in plausible.synthesised_phrases(actual).items():
        if system in IN_TIMELINE:
            variant = plausible.SYSTEMS[system].variant
            run.write(table, f"synthesis/{system}/{variant}/{record}/phrases.parquet", "segments")
    clusters = plausible.clusters("ada_1", np.random.default_rng(1))
    run.write(clusters, "phrases/prosody/clusters~8/states~3/fold~ada_1/segments.parquet", "segments")
    run.write(plausible.records(), "corpus/records.parquet", "records")
    run.write(plausible.annotations(), "corpus/annotations.parquet", "annotations")
    scores = plausible.record_scores()
    main = {name: system.variant for name, system in plausible.SYSTEMS.items()}
    session_scores = sessions.session_scores(scores, plausible.BOOTSTRAP)
    run.write(session_scores, "evaluation/session_scores.parquet", "session_scores")
    differences = sessions.differences(scores, main, plausible.BOOTSTRAP)
    run.write(scores, "evaluation/record_scores.parquet", "record_scores")
    run.write(differences, "evaluation/differences.parquet", "differences")
    motions = {}
    for place, system in enumerate((motion.ORIGINAL, *PICTURED, "random")):
        for number, record in enumerate(plausible.ACTORS):
            rng = np.random.default_rng([place, number])
            motions[system, record] = plausible.motion(record, 1 - 0.1 * place, rng)
    for record in plausible.ACTORS:
        moved = takes.Articulated(STANDARD, library.from_motion(motions[motion.ORIGINAL, record]))
        shown = takes.Take(record, [takes.Version("Original", moved, 20.0, actual[record], skinned=True)])
        (run.reports / "viewer").mkdir(parents=True, exist_ok=True)
        (run.reports / f"viewer/{record}.js").write_text(viewer.take_script(f"viewer/{record}.js", shown))
    statistics, histograms = motion.statistics(motions, plausible.ACTORS, 40)
    run.write(statistics, "evaluation/motion_statistics.parquet", "motion_statistics")
    run.write(histograms, "evaluation/motion_histograms.parquet", "motion_histograms")
    joins = {key: np.array([20, 45]) for key in motions if key[0] == PICTURED[0]}
    quality = motion_quality.table(motions, joins, plausible.ACTORS)
    run.write(quality, "evaluation/motion_quality.parquet", "motion_quality")
    run.write(recovery.table(plausible.recovery_rows()), "evaluation/recovery.parquet", "recovery")
    run.write(plausible.transplant(), "evaluation/transplant.parquet", "transplant")
    run.write(plausible.smoothing(), "animation/smoothing.parquet", "smoothing_trial")
    run.write(plausible.stills(), "animation/stills.parquet", "stills")
    run.write(plausible.cameras(), "capture/cameras.parquet", "cameras")
    run.write(plausible.capture_scores(), "capture/capture_scores.parquet", "capture_scores")
    run.write(plausible.film_effect(), "evaluation/film_effect.parquet", "film_effect")
    for name, (table, schema) in plausible.controller().items():
        if name in ("controller_libraries", "controller_strips"):
            run.write(table, f"evaluation/{name}.parquet", schema)
        else:
            for record in plausible.ACTORS:
                run.write(table, f"synthesis/controller_offline/main/{record}/{name}.parquet", schema)
    for name, (table, schema) in plausible.body_language().items():
        run.write(table, f"synthesis/bodylanguage/main/ada_1/{name}.parquet", schema)
    for path, (table, schema) in plausible_heads.results(plausible.ACTORS).items():
        run.write(table, path, schema)
    pictures = (
        "animation/stills",
        "animation/strip",
        "capture/rig",
        "animation/head_patterns",
        "animation/ada_1/heads",
    )
    for name in pictures:
        Image.new("RGB", (640, 240), (180, 190, 200)).save(run.results / f"{name}.png")
    return run


@pytest.fixture(scope="session")
def exhibits(tables_of_a_run):
    """The run with every exhibit drawn."""
    run, drawn = tables_of_a_run, exhibits_of_report.of_run(EVERY_CONDITION)
    settings = {path for exhibit in drawn for path in exhibit.settings.values()}
    run.script(
        "exhibits",
        input={"published": str(TEMPLATE / "published.yaml")},
        output=[str(run.reports / path) for exhibit in drawn for path in exhibit.files],
        exhibits=[exhibit.name for exhibit in drawn],
        sources=run.sources(exhibits_of_report.sources(drawn, NAMES)),
        settings={path: exhibits_of_report.setting(CONFIG, path) for path in settings},
    )
    return run


def make_page(run, name, *, met=EVERY_CONDITION, corpus=None, failed=()):
    """Render the page of the made-up run where it meets some conditions; return its text."""
    config = CONFIG | {"run": "made_up", "corpus": CONFIG["corpus"] | (corpus or {})}
    shown = exhibits_of_report.of_run(met)
    sources = ["records", "annotations", "session_scores", "differences"]
    sources += ["motion_statistics"] if "motion" in met else []
    sources += ["cameras"] if "filmed" in met else []
    clips = {
        f"animation/{record}/comparison.mp4": {"section": "watch", "group": actor, "title": record}
        for record, actor in plausible.ACTORS.items()
        if "motion" in met
    }
    if "transplant" in met:
        transplanted = {"section": "voice", "group": "transplant", "title": "ada_1 and the model of deniz"}
        clips["transplant/deniz/ada_1/comparison.mp4"] = transplanted
    viewed = list(plausible.ACTORS) if "motion" in met else []
    output = run.reports / name
    run.script(
        "page",
        input={
            "template": str(TEMPLATE / "page.html.jinja"),
            "published": str(TEMPLATE / "published.yaml"),
            "captions": [str(TEMPLATE / f"captions/{exhibit.name}.rst") for exhibit in shown],
            "exhibits": [str(run.reports / path) for exhibit in shown for path in exhibit.files],
            "videos": [run.path(path) for path in clips],
            "viewer": [str(run.reports / f"viewer/{record}.js") for record in viewed],
        },
        output=Named(page=str(output)),
        config=config,
        exhibits=[exhibit.name for exhibit in shown],
        sources=run.sources(sources),
        clips=[
            clip | {"description": "side by side", "link": f"../../results/made_up/{path}"}
            for path, clip in clips.items()
        ],
        viewer=viewed,
        absent=exhibits_of_report.absent(met),
        failed=list(failed),
    )
    return output.read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def virtual_page(exhibits):
    return make_page(exhibits, "index.html")


@pytest.fixture(scope="session")
def real_page(exhibits):
    corpus = {"source": "recorded", "name": "beat2"}
    failed = [{"system": "nodding", "message": "system 'nodding' of package 'nods': ImportError: no module 'neck'"}]
    return make_page(exhibits, "real.html", met=["phrases", "sweep", "two_actors"], corpus=corpus, failed=failed)

# Every exhibit beside its published value, and the page that tells them.

# What every exhibit calls the systems; in the order of the tables.
TITLES = {name: system.title for name, system in SYSTEMS.items()} | {"actual": "actual", "original": "original"}
ROLES = {
    name: {"title": system.title, "role": system.role, "controls": list(system.controls)}
    for name, system in SYSTEMS.items()
}

# The systems that pictures show: the printed one, and the one of the videos, with its strictest control.
SHOWN = config["animation"]["video"]["shown"]
PICTURED = list(dict.fromkeys(["hsmm", SHOWN]))
STRIPS = [*PICTURED, *SYSTEMS[SHOWN].controls[-1:], "random"]

# The bin width of the duration histograms that are drawn: the middle one of S.
DRAWN_BIN_S = sorted(config["evaluation"]["bins_s"])[len(config["evaluation"]["bins_s"]) // 2]
WIDEST_BIN_S = max(config["evaluation"]["bins_s"])

# The template belongs to the program, which may lie elsewhere than the results.
TEMPLATE = Path(workflow.basedir) / "reports" / "template"
PARTS = [TEMPLATE / "style.css", TEMPLATE / "table.html.jinja"]
PUBLISHED = TEMPLATE / "published.yaml"
CAPTIONS = "../../reports/template/captions"


def phrases_of(system, records):
    """The gesture phrases of some records: the actual ones, or those that a system made at the main setting."""
    if system == "actual":
        return expand(f"{RESULTS}/phrases/gesture/{{record}}.parquet", record=records)
    return expand(f"{RESULTS}/synthesis/{system}/{MAIN.path}/{{record}}/phrases.parquet", record=records)


def drawn(exhibit, category):
    """The two pictures of an exhibit, the first with its caption in Snakemake's own report."""
    return {
        "svg": report(f"{REPORTS}/figures/{exhibit}.svg", caption=f"{CAPTIONS}/{exhibit}.rst", category=category),
        "png": f"{REPORTS}/figures/{exhibit}.png",
    }


def tabled(exhibit, category):
    """The table of an exhibit that has no picture."""
    return report(f"{REPORTS}/tables/{exhibit}.csv", caption=f"{CAPTIONS}/{exhibit}.rst", category=category)


rule table_3_scenarios:
    input:
        records=f"{RESULTS}/corpus/records.parquet",
    output:
        table=tabled("table-3-scenarios", "Corpus"),
    message:
        "the corpus by scenario"
    script:
        "../../scripts/report/table_3_scenarios.py"


rule table_4_1:
    input:
        phrases=phrases_of("actual", RECORDS),
    output:
        table=tabled("table-4.1", "Corpus"),
    params:
        actors={record: actor_of(record) for record in RECORDS},
        labels=config["phrases"]["gesture"]["labels"],
    message:
        "the gesture classes"
    script:
        "../../scripts/report/table_4_1.py"


# The record that is shown from its speech to its gestures.
TIMELINE = next(iter(RECORDS))


rule fig_timeline:
    input:
        prosody=f"{RESULTS}/speech/{TIMELINE}/prosody.parquet",
        clusters=f"{RESULTS}/phrases/prosody/{MAIN.path}/fold~{TIMELINE}/segments.parquet",
        actual=phrases_of("actual", [TIMELINE]),
        synthesised=[path for system in STRIPS for path in phrases_of(system, [TIMELINE])],
    output:
        **drawn("fig-timeline", "Scores"),
        table=f"{REPORTS}/tables/fig-timeline.csv",
    params:
        record=TIMELINE,
        systems=STRIPS,
        titles=TITLES,
        labels=config["phrases"]["gesture"]["labels"],
        voiced_gain=config["speech"]["voiced_gain"],
    message:
        "one record from speech to gesture"
    script:
        "../../scripts/report/fig_timeline.py"


rule leaderboard:
    input:
        scores=rules.session_scores.output.scores,
    output:
        **drawn("leaderboard", "Scores"),
        table=f"{REPORTS}/tables/leaderboard.csv",
    params:
        systems=ROLES,
        clusters=MAIN.clusters,
        states=MAIN.states,
    message:
        "all systems on all measures"
    script:
        "../../scripts/report/leaderboard.py"


rule fig_differences:
    input:
        differences=rules.session_scores.output.differences,
    output:
        **drawn("fig-differences", "Scores"),
        table=f"{REPORTS}/tables/fig-differences.csv",
    params:
        systems=ROLES,
        bin_s=WIDEST_BIN_S,
        measures=["kappa", "D", "boundary_f1", "S"],
    message:
        "which differences the corpus resolves"
    script:
        "../../scripts/report/fig_differences.py"


rule fig_7_2a:
    input:
        scores=rules.session_scores.output.scores,
        published=PUBLISHED,
    output:
        **drawn("fig-7.2a", "Thesis"),
        table=f"{REPORTS}/tables/fig-7.2a.csv",
    params:
        axis="clusters",
        clusters=MAIN.clusters,
        states=MAIN.states,
        systems=SWEPT,
        titles=TITLES,
    message:
        "S and D against the clusters of prosody"
    script:
        "../../scripts/report/fig_7_2.py"


rule fig_7_2b:
    input:
        scores=rules.session_scores.output.scores,
        published=PUBLISHED,
    output:
        **drawn("fig-7.2b", "Thesis"),
        table=f"{REPORTS}/tables/fig-7.2b.csv",
    params:
        axis="states",
        clusters=MAIN.clusters,
        states=MAIN.states,
        systems=SWEPT,
        titles=TITLES,
    message:
        "S and D against the states of prosody"
    script:
        "../../scripts/report/fig_7_2.py"


rule fig_7_3:
    input:
        actual=phrases_of("actual", records_of(ACTORS[0])),
        synthesised=[path for system in PICTURED for path in phrases_of(system, records_of(ACTORS[0]))],
    output:
        **drawn("fig-7.3", "Thesis"),
        table=f"{REPORTS}/tables/fig-7.3.csv",
    params:
        systems=PICTURED,
        titles=TITLES,
        labels=config["phrases"]["gesture"]["labels"],
        bin_s=DRAWN_BIN_S,
        max_duration_s=config["synthesis"]["max_duration_s"],
    message:
        "duration histograms of the first actor"
    script:
        "../../scripts/report/fig_7_3.py"


if len(ACTORS) > 1:

    rule fig_7_4:
        input:
            actual=phrases_of("actual", records_of(ACTORS[1])),
            synthesised=[path for system in PICTURED for path in phrases_of(system, records_of(ACTORS[1]))],
        output:
            **drawn("fig-7.4", "Thesis"),
            table=f"{REPORTS}/tables/fig-7.4.csv",
        params:
            systems=PICTURED,
            titles=TITLES,
            labels=config["phrases"]["gesture"]["labels"],
            bin_s=DRAWN_BIN_S,
            max_duration_s=config["synthesis"]["max_duration_s"],
        message:
            "duration histograms of the second actor"
        script:
            "../../scripts/report/fig_7_3.py"


rule fig_7_5:
    input:
        actual=phrases_of("actual", RECORDS),
        synthesised=[path for system in PICTURED for path in phrases_of(system, RECORDS)],
    output:
        **drawn("fig-7.5", "Thesis"),
        table=f"{REPORTS}/tables/fig-7.5.csv",
    params:
        actors={record: actor_of(record) for record in RECORDS},
        systems=PICTURED,
        titles=TITLES,
        labels=config["phrases"]["gesture"]["labels"],
    message:
        "how often each gesture occurs"
    script:
        "../../scripts/report/fig_7_5.py"


if "motion" in BRINGS:

    rule fig_4_3:
        input:
            picture=f"{RESULTS}/animation/stills.png",
            table=f"{RESULTS}/animation/stills.parquet",
        output:
            **drawn("fig-4.3", "Corpus"),
            table=f"{REPORTS}/tables/fig-4.3.csv",
        message:
            "a picture of each gesture class"
        script:
            "../../scripts/report/fig_4_3.py"

    rule fig_6_3:
        input:
            trial=f"{RESULTS}/animation/smoothing.parquet",
        output:
            **drawn("fig-6.3", "Thesis"),
            table=f"{REPORTS}/tables/fig-6.3.csv",
        message:
            "smoothing filters at a phrase boundary"
        script:
            "../../scripts/report/fig_6_3.py"

    rule fig_6_4:
        input:
            picture=f"{RESULTS}/animation/strip.png",
        output:
            **drawn("fig-6.4", "Motion"),
        message:
            "frames of a synthesised animation"
        script:
            "../../scripts/report/picture.py"

    rule fig_motion:
        input:
            statistics=rules.motion_statistics.output.statistics,
            histograms=rules.motion_statistics.output.histograms,
        output:
            **drawn("fig-motion", "Motion"),
            table=f"{REPORTS}/tables/fig-motion.csv",
        params:
            titles=TITLES,
        message:
            "how fast the hands move"
        script:
            "../../scripts/report/fig_motion.py"


if VIRTUAL:

    rule fig_recovery:
        input:
            recovery=rules.recovery.output.recovery,
        output:
            **drawn("fig-recovery", "Studio"),
            table=f"{REPORTS}/tables/fig-recovery.csv",
        params:
            clusters=MAIN.clusters,
            states=MAIN.states,
        message:
            "what was planted, and what was found"
        script:
            "../../scripts/report/fig_recovery.py"


# What this run shows. A corpus without motion, sweep, second actor or planted truth shows less, and the page says why.
ABSENT = []
FIGURES = ["fig-timeline", "leaderboard", "fig-differences", "fig-7.3", "fig-7.5"]
TABLES = ["table-3-scenarios", "table-4.1", *FIGURES]

if SWEEP:
    FIGURES += ["fig-7.2a", "fig-7.2b"]
    TABLES += ["fig-7.2a", "fig-7.2b"]
else:
    ABSENT.append("Figure 7.2, as the configuration sweeps over no setting.")
if len(ACTORS) > 1:
    FIGURES.append("fig-7.4")
    TABLES.append("fig-7.4")
else:
    ABSENT.append("Figure 7.4, as there is one actor.")
if "motion" in BRINGS:
    FIGURES += ["fig-4.3", "fig-6.3", "fig-6.4", "fig-motion"]
    TABLES += ["fig-4.3", "fig-6.3", "fig-motion"]
else:
    ABSENT.append(
        "Videos, figures 4.3, 6.3 and 6.4 and motion statistics, as the corpus brings gesture labels and no motion."
    )
if TAKES:
    TABLES.append("table-observability")
if FILMED:
    FIGURES.append("fig-rig")
if VIRTUAL and FILMED:
    TABLES.append("table-capture")
if VIRTUAL:
    FIGURES.append("fig-recovery")
    TABLES.append("fig-recovery")
else:
    ABSENT.append("What a program planted, and the oracle that knows it, as real people were recorded.")
EXHIBITS = list(dict.fromkeys([*TABLES, *FIGURES]))
MOVING = list(RECORDS) if "motion" in BRINGS else []


rule page:
    input:
        template=TEMPLATE / "page.html.jinja",
        parts=PARTS,
        published=PUBLISHED,
        captions=[TEMPLATE / "captions" / f"{exhibit}.rst" for exhibit in EXHIBITS],
        figures=expand(f"{REPORTS}/figures/{{exhibit}}.svg", exhibit=FIGURES),
        tables=expand(f"{REPORTS}/tables/{{exhibit}}.csv", exhibit=TABLES),
        records=f"{RESULTS}/corpus/records.parquet",
        annotations=f"{RESULTS}/corpus/annotations.parquet",
        scores=rules.session_scores.output.scores,
        differences=rules.session_scores.output.differences,
        statistics=[rules.motion_statistics.output.statistics] if MOVING else [],
        cameras=[rules.calibrate.output.cameras] if VIRTUAL and FILMED else [],
        videos=expand(f"{RESULTS}/animation/{{record}}/comparison.mp4", record=MOVING),
    output:
        page=f"{REPORTS}/index.html",
    params:
        title=config["report"]["title"],
        config=config,
        systems=ROLES,
        actors={record: actor_of(record) for record in RECORDS},
        clusters=MAIN.clusters,
        states=MAIN.states,
        level_pct=100 * config["evaluation"]["bootstrap"]["level"],
        exhibits=EXHIBITS,
        figures=FIGURES,
        tables=TABLES,
        absent=ABSENT,
        links={
            exhibit: [f"figures/{exhibit}.{kind}" for kind in ("svg", "png") if exhibit in FIGURES]
            + [f"tables/{exhibit}.csv" for _ in range(exhibit in TABLES)]
            for exhibit in EXHIBITS
        },
        filmed=MOVING,
        video_links={record: f"../../{RESULTS}/animation/{record}/comparison.mp4" for record in MOVING},
        run=config["run"],
    message:
        "the page"
    script:
        "../../scripts/report/page.py"

# The exhibits of the run, drawn as they are declared, and the page that shows them.

from cospeech.report import systems as reported


def as_reported(systems):
    """Systems as the report knows them, in the order of the tables."""
    return {
        name: {
            "title": system.title,
            "role": system.role,
            "controls": list(system.controls),
            "variant": variant_of(name),
            "swept": system.swept and system.drive == "own" and not CHOSEN.apart(name),
            "plans": system.makes == "phrases",
            "origin": CHOSEN.origins.get(system.decoder),
            "source": system.source,
        }
        for name, system in systems.items()
    }


REPORTED = as_reported(SYSTEMS)
if SYSTEMS and "motion" in BRINGS:
    title = "Original motion, labelled by the same model"
    REPORTED[ORIGINAL] = {"title": title, "role": "ceiling", "variant": variant_of(ORIGINAL), "plans": False}
REPORTED_HEADS = as_reported(HEADS)
if HEADS:
    REPORTED_HEADS[SHIFTED_HEAD] = {"title": "The recorded head at other moments", "role": "control"}
KNOWN = reported.from_params(REPORTED)
PICTURED = reported.pictured(KNOWN, SHOWN_TOGETHER) if SYSTEMS else []
IN_TIMELINE = reported.in_timeline(KNOWN, SHOWN_TOGETHER) if SYSTEMS else []

# What exhibits need of a run, and whether this one has it. A condition with the name of a system is met if it runs.
MET = [
    condition
    for condition, met in {
        "phrases": SYSTEMS,
        "heads": HEADS,
        "motion": SYSTEMS and "motion" in BRINGS,
        "sweep": SYSTEMS and SWEEP,
        "two_actors": len(ACTORS) > 1,
        "transplant": SYSTEMS and TRANSPLANTS and BRINGS >= {"motion", "audio"},
        "head_transplant": TRANSPLANTED_HEADS,
        "takes": CAPTURED,
        "filmed": FILMED,
        "all_filmed": ALL_FILMED,
        "head_curves": HEADS_SHOWN and "curves" in HEADS[HEADS_SHOWN[0]].reports,
        "filmed_heads": VIRTUAL and FILMED_HEADS,
        "planted_heads": VIRTUAL and HAS_HEADS and HEADS,
        "virtual": VIRTUAL,
        "worlds": len({own.world for own in WORLDS.values()}) > 1,
    }.items()
    if met
] + [condition.name for condition in declared.CONDITIONS if condition.name in SYSTEMS]
EXHIBITS = declared.of_run(MET)
SWEEP_FIGURES = [f"{REPORTS}/{path}" for exhibit in EXHIBITS if "sweep" in exhibit.needs for path in exhibit.figures]

# What the placeholders in the paths of sources stand for.
SOURCE_NAMES = {
    "record": list(RECORDS),
    "first_record": list(RECORDS)[:1],
    "captured": CAPTURED,
    "pictured": [KNOWN[name] for name in PICTURED],
    "in_timeline": [KNOWN[name] for name in IN_TIMELINE],
    "third_party": [system for system in KNOWN.values() if system.origin],
    "first_head": [reported.System(name, **as_reported(HEADS)[name]) for name in HEADS_SHOWN[:1]],
    "shown_head": [reported.System(name, **as_reported(HEADS)[name]) for name in HEADS_SHOWN],
    "setting": [MAIN.path],
}

# What every drawing function and the page may ask about the run.
ABOUT_RUN = {
    "systems": REPORTED,
    "heads": REPORTED_HEADS,
    "shown_heads": HEADS_SHOWN,
    "actors": {record: actor_of(record) for record in RECORDS},
    "pictured": PICTURED,
    "in_timeline": IN_TIMELINE,
    "main": MAIN._asdict(),
}


def sources_of(exhibits):
    """The files that some exhibits are made from, by the name of their source."""
    return {
        name: [f"{RESULTS}/{path}" for path in paths]
        for name, paths in declared.sources(exhibits, SOURCE_NAMES).items()
    }


def made_from(sources):
    """The declared outputs that must exist before these sources are read."""
    return outputs_for(path for paths in sources.values() for path in paths)


def drawn_with(exhibits):
    """What the job that draws some exhibits is given: the run, their settings, and the code of their functions."""
    settings = {path for exhibit in exhibits for path in exhibit.settings.values()}
    return {
        **ABOUT_RUN,
        "exhibits": [exhibit.name for exhibit in exhibits],
        "sources": sources_of(exhibits),
        "settings": {path: declared.setting(config, path) for path in sorted(settings)},
        "function_code": code_hash.modules_hash(declared.modules(exhibits)),
    }


# Two jobs draw all exhibits, as starting a process takes longer than drawing one. What shows nothing but scores is
# drawn apart: it is all that the target `sweep` asks for, and on two cores both jobs run at once.
SCORES = {"session_scores", "differences"}
OF_SCORES = [exhibit for exhibit in EXHIBITS if SCORES.issuperset(exhibit.sources.values())]
OTHER_EXHIBITS = [exhibit for exhibit in EXHIBITS if exhibit not in OF_SCORES]


rule exhibits:
    input:
        sources=made_from(sources_of(OTHER_EXHIBITS)),
        published=PUBLISHED,
    output:
        *exhibit_files(OTHER_EXHIBITS),
    params:
        **drawn_with(OTHER_EXHIBITS),
    message:
        f"{len(OTHER_EXHIBITS)} exhibits"
    script:
        "../../scripts/report/exhibits.py"


rule score_exhibits:
    input:
        sources=made_from(sources_of(OF_SCORES)),
        published=PUBLISHED,
    output:
        *exhibit_files(OF_SCORES),
    params:
        **drawn_with(OF_SCORES),
    message:
        f"{len(OF_SCORES)} exhibits of scores"
    script:
        "../../scripts/report/score_exhibits.py"


# What the page reads apart from exhibits.
PAGE_SOURCES = {
    name: [f"{RESULTS}/{path}" for path in declared.SOURCES[name].paths(SOURCE_NAMES)]
    for name in [
        "records",
        *(["annotations", "session_scores", "differences"] if SYSTEMS else []),
        *(["motion_statistics"] if SYSTEMS and "motion" in BRINGS else []),
        *(["decoding"] if SYSTEMS and APART else []),
        *(["cameras"] if VIRTUAL and FILMED else []),
    ]
}

# The videos that the page contains as far as there is room: one of each actor, as the 3D viewer shows all records.
CLIPS = {
    f"{RESULTS}/animation/{record}/comparison.mp4": {
        "section": "watch",
        "group": actor_of(record),
        "title": f"{actor_of(record)}, record {record}",
        "description": f"Record {record}: the original, synthesised gestures and a control side by side",
    }
    for record in FIRST_RECORDS
    if SYSTEMS and "motion" in BRINGS
}
CLIPS |= {
    f"{RESULTS}/transplant/{actor}/{record}/comparison.mp4": {
        "section": "voice",
        "group": "transplant",
        "title": f"The voice of {record} ({actor_of(record)}) and the model of {actor}",
        "description": f"Record {record}: the original, its own actor's model and the model of {actor} side by side",
    }
    for actor, record in TRANSPLANTS
    if "transplant" in MET
}
CLIPS |= {
    f"{RESULTS}/animation/{record}/heads.mp4": {
        "section": "head",
        "group": f"head of {actor_of(record)}",
        "title": f"The head of {actor_of(record)}, record {record}",
        "description": f"Record {record}: the original head, synthesised heads and a control side by side",
    }
    for record in PORTRAYED
}

CLIPS |= {
    f"{RESULTS}/transplant/{actor}/{record}/heads.mp4": {
        "section": "head",
        "group": "transplanted head",
        "title": f"The voice of {record} ({actor_of(record)}) and the model of {actor}",
        "description": f"Record {record}: the original head, its own actor's model and the model of {actor}",
    }
    for actor, record in TRANSPLANTED_HEADS
}

# The scripts that bring the records to the 3D viewer.
VIEWER = {
    f"{actor_of(record)}, record {record}": f"{REPORTS}/viewer/{record}.js"
    for record in RECORDS
    if SYSTEMS and "motion" in BRINGS
}

# What the target `all` asks for: the page, and all that it shows or links to.
SHOWN_EXHIBITS = [f"{REPORTS}/{path}" for exhibit in EXHIBITS for path in exhibit.files]
PROMISED = [f"{REPORTS}/index.html", *SHOWN_EXHIBITS, *CLIPS, *VIEWER.values()]


rule page:
    input:
        sources=made_from(PAGE_SOURCES),
        template=TEMPLATE / "page.html.jinja",
        parts=PARTS,
        published=PUBLISHED,
        captions=[TEMPLATE / "captions" / f"{exhibit.name}.rst" for exhibit in EXHIBITS],
        exhibits=SHOWN_EXHIBITS,
        videos=list(CLIPS),
        viewer=list(VIEWER.values()),
    output:
        page=f"{REPORTS}/index.html",
    params:
        **ABOUT_RUN,
        config=config,
        exhibits=[exhibit.name for exhibit in EXHIBITS],
        function_code=code_hash.modules_hash(declared.modules(EXHIBITS)),
        sources=PAGE_SOURCES,
        clips=[clip | {"link": f"../../{path}"} for path, clip in CLIPS.items()],
        viewer=list(VIEWER),
        absent=declared.absent(MET),
        failed=CHOSEN.failures,
    message:
        "the page"
    script:
        "../../scripts/report/page.py"

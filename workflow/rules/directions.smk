# Keywords, accents and gestures in route directions (Sargin 2006, chapter 3), and the report of such a run. It has no
# actors.

SETTINGS = config["directions"]
SPEAKERS = config["studio"]["directions"]
HANDS_FPS = 30.0
GIVEN = {
    "records": f"{RESULTS}/directions/records.parquet",
    "events": f"{RESULTS}/corpus/truth/direction_events.parquet",
}
MOVEMENT = f"{RESULTS}/directions/movement.parquet"


wildcard_constraints:
    voice="|".join(SPEAKERS["voices"]),


# The synthesiser keeps state, so that every voice speaks in a process of its own.
rule direction_answers:
    output:
        records=f"{RESULTS}/directions/answers/{{voice}}/records.parquet",
        events=f"{RESULTS}/directions/answers/{{voice}}/events.parquet",
        movement=f"{RESULTS}/directions/answers/{{voice}}/movement.parquet",
        folder=directory(f"{RESULTS}/corpus/raw/{{voice}}"),
    params:
        directions=SPEAKERS,
        seed=config["seed"],
    message:
        "recording the route directions of {wildcards.voice}"
    script:
        "../../scripts/studio/direction_answers.py"


rule direction_records:
    input:
        records=expand(rules.direction_answers.output.records, voice=SPEAKERS["voices"]),
        events=expand(rules.direction_answers.output.events, voice=SPEAKERS["voices"]),
        movement=expand(rules.direction_answers.output.movement, voice=SPEAKERS["voices"]),
    output:
        **GIVEN,
        movement=MOVEMENT,
    message:
        "table of answers"
    script:
        "../../scripts/studio/direction_records.py"


rule direction_features:
    input:
        records=rules.direction_answers.output.records,
        folder=rules.direction_answers.output.folder,
    output:
        mfcc=f"{RESULTS}/directions/mfcc/{{voice}}.parquet",
        accents=f"{RESULTS}/directions/accent_features/{{voice}}.parquet",
    params:
        seed=config["seed"],
    message:
        "features of the speech of {wildcards.voice}"
    script:
        "../../scripts/speech/direction_features.py"


rule keywords:
    input:
        **GIVEN,
        mfcc=expand(rules.direction_features.output.mfcc, voice=SPEAKERS["voices"]),
    output:
        detections=f"{RESULTS}/directions/detections/keywords.parquet",
    params:
        keywords=SETTINGS["keywords"],
        training=SETTINGS["training"],
        seed=config["seed"],
    message:
        "keywords"
    script:
        "../../scripts/speech/keywords.py"


rule accents:
    input:
        **GIVEN,
        features=expand(rules.direction_features.output.accents, voice=SPEAKERS["voices"]),
    output:
        detections=f"{RESULTS}/directions/detections/accents.parquet",
    params:
        accents=SETTINGS["accents"],
        training=SETTINGS["training"],
        seed=config["seed"],
    message:
        "pitch accents"
    script:
        "../../scripts/speech/accents.py"


rule direction_gestures:
    input:
        **GIVEN,
        movement=MOVEMENT,
    output:
        detections=f"{RESULTS}/directions/detections/gestures.parquet",
    params:
        gestures=SETTINGS["gestures"],
        training=SETTINGS["training"],
        fps=HANDS_FPS,
        seed=config["seed"],
    message:
        "gestures of hands and head"
    script:
        "../../scripts/segmentation/direction_gestures.py"


rule direction_scores:
    input:
        **GIVEN,
        detections=[
            rules.keywords.output.detections,
            rules.accents.output.detections,
            rules.direction_gestures.output.detections,
        ],
    output:
        scores=f"{RESULTS}/directions/scores.parquet",
    params:
        keywords=SETTINGS["keywords"]["words"],
        bootstrap=config["evaluation"]["bootstrap"],
        seed=config["seed"],
    message:
        "scores of keywords, accents and gestures"
    script:
        "../../scripts/evaluation/direction_scores.py"


rule co_occurrence:
    input:
        **GIVEN,
    output:
        co_occurrence=f"{RESULTS}/directions/co_occurrence.parquet",
        pairs=f"{RESULTS}/directions/co_occurrence_pairs.parquet",
    params:
        keywords=SETTINGS["keywords"]["words"],
        shifts=SETTINGS["shifts"],
        level=config["evaluation"]["bootstrap"]["level"],
        seed=config["seed"],
    message:
        "speech and gestures at the same time"
    script:
        "../../scripts/evaluation/co_occurrence.py"


rule direction_animation:
    input:
        **GIVEN,
        movement=MOVEMENT,
        keywords=rules.keywords.output.detections,
        accents=rules.accents.output.detections,
    output:
        animation=f"{RESULTS}/directions/animation.parquet",
    params:
        states=SETTINGS["gestures"]["hand_states"],
        gaussians=max(SETTINGS["keywords"]["gaussians"]),
        features="Δf, p, I",
        training=SETTINGS["training"],
        fps=HANDS_FPS,
        seed=config["seed"],
    message:
        "animation of an answer"
    script:
        "../../scripts/synthesis/direction_animation.py"


rule direction_strip:
    input:
        animation=rules.direction_animation.output.animation,
    output:
        strip=f"{RESULTS}/directions/strip.png",
    message:
        "stick figure and body"
    script:
        "../../scripts/rendering/direction_strip.py"


EXHIBITS = declared.DIRECTIONS
EXHIBIT_SOURCES = {
    name: [f"{RESULTS}/{path}" for path in paths] for name, paths in declared.sources(EXHIBITS, {}).items()
}


rule direction_exhibits:
    input:
        sources=[path for paths in EXHIBIT_SOURCES.values() for path in paths],
        published=PUBLISHED,
    output:
        *exhibit_files(EXHIBITS),
    params:
        **WITHOUT_SYSTEMS,
        exhibits=[exhibit.name for exhibit in EXHIBITS],
        sources=EXHIBIT_SOURCES,
        settings={},
        function_code=code_hash.modules_hash(declared.modules(EXHIBITS)),
    message:
        f"{len(EXHIBITS)} exhibits"
    script:
        "../../scripts/report/exhibits.py"


PAGE_SOURCES = {
    "direction_records": [GIVEN["records"]],
    **{name: EXHIBIT_SOURCES[name] for name in ["direction_scores", "co_occurrence"]},
}
PROMISED = [f"{REPORTS}/index.html", *(f"{REPORTS}/{path}" for exhibit in EXHIBITS for path in exhibit.files)]


rule direction_page:
    input:
        sources=[path for paths in PAGE_SOURCES.values() for path in paths],
        template=TEMPLATE / "page.html.jinja",
        parts=PARTS,
        published=PUBLISHED,
        captions=[TEMPLATE / "captions" / f"{exhibit.name}.rst" for exhibit in EXHIBITS],
        exhibits=PROMISED[1:],
    output:
        page=PROMISED[0],
    params:
        **WITHOUT_SYSTEMS,
        config=config,
        exhibits=[exhibit.name for exhibit in EXHIBITS],
        function_code=code_hash.modules_hash(declared.modules(EXHIBITS)),
        sources=PAGE_SOURCES,
    message:
        "the page"
    script:
        "../../scripts/report/direction_page.py"

# Gesture phrases, phases and subunits from joint angles, and intonation phrases from prosody.

# Phases and subunits are written by the jobs that find gesture phrases. They are not declared as outputs; rules that
# read them depend on the phrases.
SEGMENTATION = {"folder": f"{RESULTS}/segmentation", "segmentation": config["segmentation"]}
SECTIONS = ("head", "arms", "legs")
TABLES = {"phases": "phases", **{f"subunits/{section}": "subunits" for section in SECTIONS}}


def phases_of(place):
    """The gesture phases of the records that a fold, or the model of an actor, learns from."""
    return f"{SEGMENTATION['folder']}/phases/{place}.parquet"


def subunits_of(place):
    """Their gesture subunits by body section."""
    return {section: f"{SEGMENTATION['folder']}/subunits/{section}/{place}.parquet" for section in SECTIONS}


def clusters_of_fold(setting):
    """The intonation phrases of one fold; the model and its fit, which no rule reads, are written next to them."""
    return f"{RESULTS}/phrases/prosody/{setting.path}/fold~{{record}}/segments.parquet"


# A corpus of complete gesture segments brings these tables itself.
if "motion" in BRINGS:

    rule gesture_model:
        input:
            motion=lambda wildcards: expand(
                f"{RESULTS}/motion/{{record}}.parquet",
                record=records_of(wildcards.actor),
            ),
            annotations=lambda wildcards: expand(
                f"{RESULTS}/corpus/annotations/{{record}}.parquet",
                record=records_of(wildcards.actor),
            ),
        output:
            model=f"{RESULTS}/phrases/gesture/actor~{{actor}}/model.parquet",
            fit=f"{RESULTS}/phrases/gesture/actor~{{actor}}/fit.parquet",
        params:
            **SEGMENTATION,
            records=lambda wildcards: records_of(wildcards.actor),
            settings=config["phrases"]["gesture"],
            place="actor~{actor}",
        message:
            "gesture phrase model of {wildcards.actor}"
        script:
            "../../scripts/segmentation/gesture_model.py"

    rule gesture_phrases:
        input:
            model=lambda wildcards: f"{RESULTS}/phrases/gesture/actor~{actor_of(wildcards.record)}/model.parquet",
            motion=f"{RESULTS}/motion/{{record}}.parquet",
            annotations=f"{RESULTS}/corpus/annotations/{{record}}.parquet",
        output:
            segments=f"{RESULTS}/phrases/gesture/{{record}}.parquet",
        params:
            folder=SEGMENTATION["folder"],
            tables=TABLES,
            place=lambda wildcards: f"actor~{actor_of(wildcards.record)}",
        message:
            "gesture phrases of {wildcards.record}"
        script:
            "../../scripts/segmentation/gesture_phrases.py"

    rule gesture_fold:
        input:
            motion=lambda wildcards: expand(f"{RESULTS}/motion/{{record}}.parquet", record=others(wildcards.fold)),
            annotations=lambda wildcards: expand(
                f"{RESULTS}/corpus/annotations/{{record}}.parquet",
                record=others(wildcards.fold),
            ),
        output:
            segments=f"{RESULTS}/phrases/gesture/fold~{{fold}}/segments.parquet",
            model=f"{RESULTS}/phrases/gesture/fold~{{fold}}/model.parquet",
            fit=f"{RESULTS}/phrases/gesture/fold~{{fold}}/fit.parquet",
        params:
            **SEGMENTATION,
            records=lambda wildcards: others(wildcards.fold),
            settings=config["phrases"]["gesture"],
            place="fold~{fold}",
        message:
            "gesture phrases without {wildcards.fold}"
        script:
            "../../scripts/segmentation/gesture_fold.py"


def records_of_fold(wildcards):
    """All records of the actor of a fold, the one held out among them."""
    return records_of(actor_of(wildcards.record))


def prosody_of_fold(wildcards):
    """The prosody of these records."""
    return expand(f"{RESULTS}/speech/{{record}}/prosody.parquet", record=records_of_fold(wildcards))


def training_of_fold(wildcards):
    """The records whose prosody a fold learns from."""
    strict = config["phrases"]["folds"] == "strict"
    return others(wildcards.record) if strict else records_of_fold(wildcards)


def syllables_of_fold(wildcards):
    """The syllables of these records."""
    return expand(f"{RESULTS}/speech/{{record}}/syllables.parquet", record=records_of_fold(wildcards))


rule prosody_clusters:
    input:
        prosody=prosody_of_fold,
    output:
        segments=clusters_of_fold(MAIN),
    params:
        records=records_of_fold,
        training=training_of_fold,
        setting=tuple(MAIN),
        settings=config["phrases"]["prosody"],
        frame_s=config["speech"]["frame_s"],
        seed=config["seed"],
    message:
        "prosody clusters without {wildcards.record}"
    script:
        "../../scripts/segmentation/prosody_clusters.py"

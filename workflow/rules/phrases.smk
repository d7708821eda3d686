# Gesture phrases from joint angles, and intonation phrases from prosody.


def cluster_tables(settings):
    """The named outputs of the prosody clusters of one fold at these settings."""
    folders = [f"{RESULTS}/phrases/prosody/{setting.path}/fold~{{fold}}" for setting in settings]
    return {name: [f"{folder}/{name}.parquet" for folder in folders] for name in ("segments", "model", "fit")}


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
        log:
            f"{RESULTS}/logs/gesture_model/{{actor}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/gesture_model/{{actor}}.tsv"
        params:
            records=lambda wildcards: records_of(wildcards.actor),
            settings=config["phrases"]["gesture"],
            corpus=config["corpus"]["name"],
            code=code("phrases/gesture_model"),
        message:
            "gesture phrase model of {wildcards.actor}"
        script:
            "../../scripts/phrases/gesture_model.py"

    rule gesture_phrases:
        input:
            model=lambda wildcards: f"{RESULTS}/phrases/gesture/actor~{actor_of(wildcards.record)}/model.parquet",
            motion=f"{RESULTS}/motion/{{record}}.parquet",
            annotations=f"{RESULTS}/corpus/annotations/{{record}}.parquet",
        output:
            segments=f"{RESULTS}/phrases/gesture/{{record}}.parquet",
        log:
            f"{RESULTS}/logs/gesture_phrases/{{record}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/gesture_phrases/{{record}}.tsv"
        params:
            corpus=config["corpus"]["name"],
            code=code("phrases/gesture_phrases"),
        message:
            "gesture phrases of {wildcards.record}"
        script:
            "../../scripts/phrases/gesture_phrases.py"

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
        log:
            f"{RESULTS}/logs/gesture_fold/{{fold}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/gesture_fold/{{fold}}.tsv"
        params:
            records=lambda wildcards: others(wildcards.fold),
            settings=config["phrases"]["gesture"],
            corpus=config["corpus"]["name"],
            code=code("phrases/gesture_fold"),
        message:
            "gesture phrases without {wildcards.fold}"
        script:
            "../../scripts/phrases/gesture_fold.py"


rule prosody_clusters:
    input:
        prosody=lambda wildcards: expand(
            f"{RESULTS}/speech/{{record}}/prosody.parquet",
            record=records_of(actor_of(wildcards.fold)),
        ),
    output:
        **cluster_tables([MAIN]),
    log:
        f"{RESULTS}/logs/prosody_clusters/{{fold}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/prosody_clusters/{{fold}}.tsv"
    params:
        records=lambda wildcards: records_of(actor_of(wildcards.fold)),
        training=lambda wildcards: (
            others(wildcards.fold)
            if config["phrases"]["folds"] == "strict"
            else records_of(actor_of(wildcards.fold))
        ),
        clusters=[tuple(MAIN)],
        settings=config["phrases"]["prosody"],
        frame_s=config["speech"]["frame_s"],
        seed=config["seed"],
        corpus=config["corpus"]["name"],
        code=code("phrases/prosody_clusters"),
    message:
        "prosody clusters without {wildcards.fold}"
    script:
        "../../scripts/phrases/prosody_clusters.py"


if SWEEP:

    use rule prosody_clusters as sweep_clusters with:
        output:
            **cluster_tables(SWEEP),
        log:
            f"{RESULTS}/logs/sweep_clusters/{{fold}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/sweep_clusters/{{fold}}.tsv"
        params:
            clusters=[tuple(setting) for setting in SWEEP],
        message:
            "prosody clusters of the sweep without {wildcards.fold}"

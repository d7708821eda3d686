# Gesture phrases for the record that a fold holds out: the HSMM in its forms, its controls, and ceilings.

# How the tables of the HSMM are counted; the number of prosody clusters joins it, setting by setting.
ESTIMATE = {
    "labels": config["phrases"]["gesture"]["labels"],
    "max_duration_s": config["synthesis"]["max_duration_s"],
    "floor": config["synthesis"]["floor"],
    "smoothing": config["synthesis"]["durations"]["smoothing"],
    "amount": config["synthesis"]["durations"]["amount"],
}


def made_by(system, table, setting=MAIN):
    """The path of one table that a system leaves."""
    return f"{RESULTS}/synthesis/{system}/{setting.path}/{{record}}/{table}.parquet"


def tables_of_model(system, setting=MAIN):
    """The paths of a model's four tables."""
    return [made_by(system, name, setting) for name in ("initial", "transitions", "emissions", "durations")]


def fold_prosody(setting=MAIN):
    """The prosody phrases of all records of the fold's actor."""
    return f"{RESULTS}/phrases/prosody/{setting.path}/fold~{{record}}/segments.parquet"


def training_gestures(wildcards):
    """The gesture phrases that a fold may learn from: those of the actor's other records."""
    if "motion" in BRINGS:
        return [f"{RESULTS}/phrases/gesture/fold~{wildcards.record}/segments.parquet"]
    return [f"{RESULTS}/phrases/gesture/{other}.parquet" for other in others(wildcards.record)]


def actor_of_fold(wildcards):
    return actor_of(wildcards.record)


# The HSMM in its forms, each under wrong speech too, what hears none, and what knows the truth: so small that they
# share a process for each record.
FORMS = ["hsmm", "hsmm_weighted", "hsmm_sampled"]
TOGETHER = [
    *FORMS,
    *(control for form in FORMS for control in SYSTEMS[form].controls),
    *["random", "prior", "clock", "majority", "another"],
    *(["oracle"] if VIRTUAL else []),
]

# What was planted, for the oracle that knows it.
TRUTH = f"{RESULTS}/corpus/truth"
PLANTED = {
    "planted": [f"{TRUTH}/{name}.parquet" for name in ("initial", "transitions", "emissions", "durations")],
    "planted_gestures": f"{TRUTH}/gesture_phrases.parquet",
    "planted_prosody": f"{TRUTH}/prosody_phrases.parquet",
}


rule systems:
    input:
        **(PLANTED if VIRTUAL else {}),
        gestures=training_gestures,
        prosody=fold_prosody(),
    output:
        **({"oracle": tables_of_model("oracle")} if VIRTUAL else {}),
        hsmm=tables_of_model("hsmm"),
        phrases=[made_by(system, "phrases") for system in TOGETHER],
        decoding=[made_by(system, "decoding") for system in TOGETHER],
    params:
        systems=TOGETHER,
        estimate=ESTIMATE | {"clusters": MAIN.clusters},
        weights=config["synthesis"]["emission_weights"],
        censoring=config["synthesis"]["censoring"],
        shift_s=config["synthesis"]["shift_s"],
        actor=actor_of_fold,
        records=records_of_fold,
        frame_s=config["speech"]["frame_s"],
        seed=config["seed"],
    message:
        f"phrases of {{wildcards.record}} by {len(TOGETHER)} systems"
    script:
        "../../scripts/synthesis/systems.py"


if SWEEP:

    # One process for a fold: a setting is clustered, and what decodes the gestures goes on with it.
    rule sweep_settings:
        input:
            prosody=prosody_of_fold,
            gestures=training_gestures,
        output:
            **{name: [cluster_tables(setting)[name] for setting in SWEEP] for name in cluster_tables(MAIN)},
            tables=[path for setting in SWEEP for path in tables_of_model("hsmm", setting)],
            phrases=[made_by("hsmm", "phrases", setting) for setting in SWEEP],
            decoding=[made_by("hsmm", "decoding", setting) for setting in SWEEP],
            weighted_phrases=[made_by("hsmm_weighted", "phrases", setting) for setting in SWEEP],
            weighted_decoding=[made_by("hsmm_weighted", "decoding", setting) for setting in SWEEP],
        params:
            records=records_of_fold,
            training=training_of_fold,
            sweep=[tuple(setting) for setting in SWEEP],
            settings=config["phrases"]["prosody"],
            estimate=ESTIMATE,
            weights=config["synthesis"]["emission_weights"],
            censoring=config["synthesis"]["censoring"],
            frame_s=config["speech"]["frame_s"],
            seed=config["seed"],
        message:
            f"{{wildcards.record}} at {len(SWEEP)} settings: prosody clusters, HSMM, phrases"
        script:
            "../../scripts/synthesis/sweep_settings.py"

# Gesture phrases for the record that a fold holds out: the HSMM in its forms, its controls, and ceilings.

# What hears no speech, and every decoder of the HSMM under wrong speech.
CONTROLS = ["random", "prior", "clock", "majority", "another"] + [
    control for system in ("hsmm", "hsmm_weighted", "hsmm_sampled") for control in SYSTEMS[system].controls
]

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


def tables_of_model(system, settings=None):
    """The paths of a model's four tables by name, or lists of them where settings are given."""
    names = ("initial", "transitions", "emissions", "durations")
    if settings is None:
        return {name: made_by(system, name) for name in names}
    return {name: [made_by(system, name, setting) for setting in settings] for name in names}


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


def records_of_fold(wildcards):
    return records_of(actor_of(wildcards.record))


# Printed and weighted decoding in one process, as a start costs more than either; they share the four tables.
rule hsmm:
    input:
        gestures=training_gestures,
        prosody=[fold_prosody()],
    output:
        **tables_of_model("hsmm", [MAIN]),
        phrases=[made_by("hsmm", "phrases")],
        decoding=[made_by("hsmm", "decoding")],
        weighted_phrases=[made_by("hsmm_weighted", "phrases")],
        weighted_decoding=[made_by("hsmm_weighted", "decoding")],
    log:
        f"{RESULTS}/logs/hsmm/{{record}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/hsmm/{{record}}.tsv"
    params:
        clusters=[MAIN.clusters],
        estimate=ESTIMATE,
        weights=config["synthesis"]["emission_weights"],
        censoring=config["synthesis"]["censoring"],
        frame_s=config["speech"]["frame_s"],
        corpus=config["corpus"]["name"],
        code=code("synthesis/hsmm"),
    message:
        "phrases of {wildcards.record} by the HSMM, printed and weighted"
    script:
        "../../scripts/synthesis/hsmm.py"


if SWEEP:

    use rule hsmm as sweep_hsmm with:
        input:
            gestures=training_gestures,
            prosody=[fold_prosody(setting) for setting in SWEEP],
        output:
            **tables_of_model("hsmm", SWEEP),
            phrases=[made_by("hsmm", "phrases", setting) for setting in SWEEP],
            decoding=[made_by("hsmm", "decoding", setting) for setting in SWEEP],
            weighted_phrases=[made_by("hsmm_weighted", "phrases", setting) for setting in SWEEP],
            weighted_decoding=[made_by("hsmm_weighted", "decoding", setting) for setting in SWEEP],
        log:
            f"{RESULTS}/logs/sweep_hsmm/{{record}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/sweep_hsmm/{{record}}.tsv"
        params:
            clusters=[setting.clusters for setting in SWEEP],
        message:
            f"phrases of {{wildcards.record}} by the HSMM, printed and weighted, at {len(SWEEP)} settings"


# One process for all of a record, and for what is drawn from its HSMM, as each of them is less work than a start.
rule controls:
    input:
        **tables_of_model("hsmm"),
        weighted=made_by("hsmm_weighted", "decoding"),
        gestures=training_gestures,
        prosody=fold_prosody(),
    output:
        phrases=[made_by(system, "phrases") for system in ["hsmm_sampled", *CONTROLS]],
        decoding=[made_by(system, "decoding") for system in ["hsmm_sampled", *CONTROLS]],
    log:
        f"{RESULTS}/logs/controls/{{record}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/controls/{{record}}.tsv"
    params:
        systems=["hsmm_sampled", *CONTROLS],
        records=records_of_fold,
        shift_s=config["synthesis"]["shift_s"],
        censoring=config["synthesis"]["censoring"],
        seed=config["seed"],
        frame_s=config["speech"]["frame_s"],
        corpus=config["corpus"]["name"],
        code=code("synthesis/controls"),
    message:
        "phrases of {wildcards.record} drawn from the HSMM, under wrong speech, or under none"
    script:
        "../../scripts/synthesis/controls.py"


if VIRTUAL:

    rule oracle:
        input:
            found=fold_prosody(),
            gestures=f"{RESULTS}/corpus/truth/gesture_phrases.parquet",
            prosody=f"{RESULTS}/corpus/truth/prosody_phrases.parquet",
            initial=f"{RESULTS}/corpus/truth/initial.parquet",
            transitions=f"{RESULTS}/corpus/truth/transitions.parquet",
            emissions=f"{RESULTS}/corpus/truth/emissions.parquet",
            durations=f"{RESULTS}/corpus/truth/durations.parquet",
        output:
            **tables_of_model("oracle"),
            phrases=made_by("oracle", "phrases"),
            decoding=made_by("oracle", "decoding"),
        log:
            f"{RESULTS}/logs/oracle/{{record}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/oracle/{{record}}.tsv"
        params:
            actor=actor_of_fold,
            floor=config["synthesis"]["floor"],
            weights=config["synthesis"]["emission_weights"],
            censoring=config["synthesis"]["censoring"],
            frame_s=config["speech"]["frame_s"],
            corpus=config["corpus"]["name"],
            code=code("synthesis/oracle"),
        message:
            "phrases of {wildcards.record} by the planted HSMM"
        script:
            "../../scripts/synthesis/oracle.py"

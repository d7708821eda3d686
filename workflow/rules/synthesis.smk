# Gesture phrases, or motion, for the record that a fold holds out: systems, their controls, and ceilings.


def place_of(system, setting=MAIN):
    """The variant of a system, and the folder of its records."""
    variant = variant_of(system, setting)
    return variant, f"{RESULTS}/synthesis/{system}/{variant}"


def needed(systems, need):
    """Whether one of these systems needs it."""
    return any(need in SYSTEMS[system].needs for system in systems)


# The syllables of a record, which beats of the motion are compared with, if a system needs syllables anyway.
SPOKEN_SYLLABLES = f"{RESULTS}/speech/{{record}}/syllables.parquet" if needed(SYSTEMS, "syllables") else []


def training_gestures(wildcards):
    """The gesture phrases that a fold may learn from: those of the actor's other records."""
    if "motion" in BRINGS:
        return [f"{RESULTS}/phrases/gesture/fold~{wildcards.record}/segments.parquet"]
    return [f"{RESULTS}/phrases/gesture/{other}.parquet" for other in others(wildcards.record)]


def actor_of_fold(wildcards):
    return actor_of(wildcards.record)


def motions_of_fold(wildcards):
    """The motion of all records of the actor of a fold."""
    return expand(f"{RESULTS}/motion/{{record}}.parquet", record=records_of_fold(wildcards))


def subunits_of_fold(wildcards):
    """The gesture subunits of the records that a fold may learn from."""
    return subunits_of(f"fold~{wildcards.record}")


# The tables of the process that the virtual studio planted.
PLANTED_TABLES = ["initial", "transitions", "emissions", "durations"]


def inputs_of(systems):
    """What these systems learn from and listen to."""
    return {
        "gestures": training_gestures,
        "clusters": clusters_of_fold(MAIN),
        "prosody": prosody_of_fold if needed(systems, "prosody") else [],
        "syllables": syllables_of_fold if needed(systems, "syllables") else [],
        "motions": motions_of_fold if needed(systems, "motion") or makers(systems, "motion") else [],
        "model": f"{RESULTS}/phrases/gesture/fold~{{record}}/model.parquet" if makers(systems, "motion") else [],
        "spoken": SPOKEN_SYLLABLES,
        # One table represents everything that was planted, as one job writes it all.
        "planted": f"{RESULTS}/corpus/truth/gesture_phrases.parquet" if needed(systems, "truth") else [],
    }


def params_of(systems, apart):
    """The parameters of a job that runs these systems."""
    return {
        "systems": systems,
        "apart": apart,
        "places": {system: place_of(system) for system in systems},
        "tables": model_tables(systems),
        "planted": PLANTED_TABLES if needed(systems, "truth") else [],
        # Written by the job that finds the gesture phrases of the fold, which is an input.
        "phases": phases_of("fold~{record}") if needed(systems, "phases") else "",
        "subunits": subunits_of_fold if needed(systems, "subunits") else {},
        "shared": SHARED_SETTINGS,
        "own": own_settings(systems),
        "labels": config["phrases"]["gesture"]["labels"],
        "symbols": list(prosody_labels(MAIN.clusters)),
        "wrong": {"shift_s": SYNTHESIS["shift_s"], **config["evaluation"]["interior"]},
        "frame_s": config["speech"]["frame_s"],
        "seed": config["seed"],
        "method_code": code_hash.modules_hash(
            [name for system in systems for name in (SYSTEMS[system].method, SYSTEMS[system].schemas) if name]
        ),
    }


# A job writes all that a system leaves of a record into one folder, and Snakemake is told of what other rules read:
# each declared file costs as much planning as a tenth of a job.
rule systems:
    input:
        **inputs_of(TOGETHER),
    output:
        animated=[
            made_by(system, "phrases.parquet")
            for system in makers(ANIMATED_TOGETHER, "phrases")
            if "motion" in BRINGS
        ],
        made=[made_by(system, "motion.parquet") for system in makers(TOGETHER, "motion")],
        planned=PLANNED,
        seen=SEEN_IN_MADE if makers(TOGETHER, "motion") else [],
        scores=MADE_SCORES if makers(TOGETHER, "motion") else [],
    params:
        **params_of(TOGETHER, apart=False),
        actor=actor_of_fold,
        records=records_of_fold,
    message:
        f"phrases of {{wildcards.record}} by {len(TOGETHER)} systems"
    script:
        "../../scripts/synthesis/systems.py"


for name in APART:

    rule:
        name:
            f"systems_{name}"
        input:
            **inputs_of([name, *SYSTEMS[name].controls]),
        output:
            made=[made_by(system, f"{SYSTEMS[system].makes}.parquet") for system in [name, *SYSTEMS[name].controls]],
            decoding=[made_by(system, "decoding.parquet") for system in [name, *SYSTEMS[name].controls]],
            planned=planned_apart(name) if SYSTEMS[name].makes == "phrases" else [],
            seen=seen_apart(name) if SYSTEMS[name].makes == "motion" else [],
            scores=scores_apart(name) if SYSTEMS[name].makes == "motion" else [],
        params:
            **params_of([name, *SYSTEMS[name].controls], apart=True),
            actor=actor_of_fold,
            records=records_of_fold,
        message:
            f"{SYSTEMS[name].makes} of {{wildcards.record}} by {name} and its controls"
        script:
            "../../scripts/synthesis/systems.py"


if SWEEP:

    # One process for a fold: at each setting, the prosody is clustered and the systems that are swept decode it.
    rule sweep_settings:
        input:
            prosody=prosody_of_fold,
            gestures=training_gestures,
        output:
            segments=[clusters_of_fold(setting) for setting in SWEEP],
            planned=f"{RESULTS}/evaluation/swept/{{record}}.parquet",
        params:
            systems=SWEPT,
            places=[{system: place_of(system, setting) for system in SWEPT} for setting in SWEEP],
            tables=model_tables(SWEPT),
            actor=actor_of_fold,
            records=records_of_fold,
            training=training_of_fold,
            sweep=[tuple(setting) for setting in SWEEP],
            settings=config["phrases"]["prosody"],
            shared=SHARED_SETTINGS,
            own=own_settings(SWEPT),
            labels=config["phrases"]["gesture"]["labels"],
            frame_s=config["speech"]["frame_s"],
            seed=config["seed"],
            method_code=code_hash.modules_hash([SYSTEMS[system].method for system in SWEPT]),
        message:
            f"{{wildcards.record}} at {len(SWEEP)} settings: prosody clusters, and phrases by {', '.join(SWEPT)}"
        script:
            "../../scripts/synthesis/sweep_settings.py"

# Gesture phrases, or motion, for the record that a fold holds out: systems, their controls, and ceilings.

SYNTHESIS = config["synthesis"]
SHARED_SETTINGS = {key: value for key, value in SYNTHESIS.items() if key != "systems"}
OWN_SETTINGS = {name: value for name, value in SYNTHESIS["systems"].items() if value}

# Systems of cospeech itself are so small that they share a process for each record. One that another package brings
# runs in a process of its own, with its controls under wrong speech, so that it cannot harm the others.
TOGETHER = [name for name in SYSTEMS if not CHOSEN.apart(name)]
APART = [name for name, system in SYSTEMS.items() if CHOSEN.apart(name) and system.drive == "own"]
SWEPT = [name for name in TOGETHER if SYSTEMS[name].swept and SYSTEMS[name].drive == "own"]


# Not a system: the record's own motion, labelled as that of systems is. What systems can reach at best where they are
# judged by their motion.
ORIGINAL = "original"


def variant_of(system, setting=MAIN):
    """The variant of a system at one setting of the prosody clusters; 'main' where it does not listen to these."""
    listens = system != ORIGINAL and "prosody_labels" in SYSTEMS[system].needs
    return setting.variant if listens else "main"


def made_by(system, name, setting=MAIN):
    """The path of one artifact of a system."""
    return f"{RESULTS}/synthesis/{system}/{variant_of(system, setting)}/{{record}}/{name}"


def makers(systems, output):
    """The systems among these that make phrases, or motion."""
    return [system for system in systems if SYSTEMS[system].makes == output]


def model_tables(systems, setting=MAIN):
    """The tables of the models that these systems train: system, table, schema and path of each."""
    return [
        (system, table, schema, made_by(system, f"{table}.parquet", setting))
        for system in systems
        if SYSTEMS[system].role != "control" and SYSTEMS[system].model == system
        for table, schema in SYSTEMS[system].tables.items()
    ]


def needed(systems, need):
    """Whether one of these systems needs it."""
    return any(need in SYSTEMS[system].needs for system in systems)


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


# The tables of the process that the virtual studio planted.
PLANTED_TABLES = ["initial", "transitions", "emissions", "durations"]


def inputs_of(systems):
    """What these systems learn from and listen to."""
    truth = f"{RESULTS}/corpus/truth"
    planted = {
        "planted": [f"{truth}/{name}.parquet" for name in PLANTED_TABLES],
        "planted_gestures": f"{truth}/gesture_phrases.parquet",
        "planted_prosody": f"{truth}/prosody_phrases.parquet",
    }
    return {
        "gestures": training_gestures,
        "clusters": f"{RESULTS}/phrases/prosody/{MAIN.path}/fold~{{record}}/segments.parquet",
        "prosody": prosody_of_fold if needed(systems, "prosody") else [],
        "motions": motions_of_fold if needed(systems, "motion") or makers(systems, "motion") else [],
        **(planted if needed(systems, "truth") else {}),
    }


def outputs_of(systems):
    """What these systems leave of a record."""
    return {
        "phrases": [made_by(system, "phrases.parquet") for system in makers(systems, "phrases")],
        "motion": [made_by(system, "motion.parquet") for system in makers(systems, "motion")],
        "decoding": [made_by(system, "decoding.parquet") for system in systems],
        "tables": [path for _, _, _, path in model_tables(systems)],
    }


def params_of(systems, apart):
    """The parameters of a job that runs these systems."""
    return {
        "systems": systems,
        "apart": apart,
        "phrases": makers(systems, "phrases"),
        "motion": makers(systems, "motion"),
        "tables": [(system, table, schema) for system, table, schema, _ in model_tables(systems)],
        "planted": PLANTED_TABLES if needed(systems, "truth") else [],
        "shared": SHARED_SETTINGS,
        "own": {name: value for name, value in OWN_SETTINGS.items() if name in systems},
        "labels": config["phrases"]["gesture"]["labels"],
        "symbols": list(prosody_labels(MAIN.clusters)),
        "shift_s": SYNTHESIS["shift_s"],
        "frame_s": config["speech"]["frame_s"],
        "seed": config["seed"],
        "methods": code_hash.modules_hash(
            [name for system in systems for name in (SYSTEMS[system].method, SYSTEMS[system].schemas) if name]
        ),
    }


rule systems:
    input:
        **inputs_of(TOGETHER),
    output:
        **outputs_of(TOGETHER),
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
            **outputs_of([name, *SYSTEMS[name].controls]),
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
            **{name: [cluster_tables(setting)[name] for setting in SWEEP] for name in cluster_tables(MAIN)},
            phrases=[made_by(system, "phrases.parquet", setting) for setting in SWEEP for system in SWEPT],
            decoding=[made_by(system, "decoding.parquet", setting) for setting in SWEEP for system in SWEPT],
            tables=[path for setting in SWEEP for _, _, _, path in model_tables(SWEPT, setting)],
        params:
            systems=SWEPT,
            tables=[(system, table, schema) for system, table, schema, _ in model_tables(SWEPT)],
            actor=actor_of_fold,
            records=records_of_fold,
            training=training_of_fold,
            sweep=[tuple(setting) for setting in SWEEP],
            settings=config["phrases"]["prosody"],
            shared=SHARED_SETTINGS,
            own=OWN_SETTINGS,
            labels=config["phrases"]["gesture"]["labels"],
            frame_s=config["speech"]["frame_s"],
            seed=config["seed"],
            methods=code_hash.modules_hash([SYSTEMS[system].method for system in SWEPT]),
        message:
            f"{{wildcards.record}} at {len(SWEEP)} settings: prosody clusters, and phrases by {', '.join(SWEPT)}"
        script:
            "../../scripts/synthesis/sweep_settings.py"

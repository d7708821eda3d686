# Scores of every synthesised record and of synthesis sessions, and of what the virtual studio planted.

# Phrases that are seen in the motion of units lie in files of their own. All others share a table for each record, except
# that a system of another package and its controls have one of their own.
SEEN = [*makers(ANIMATED, "phrases"), ORIGINAL] if "motion" in BRINGS else []
PLANNED_TABLES_OF = [PLANNED, *map(planned_apart, makers(APART, "phrases"))]
SEEN_TABLES_OF = [
    *([SEEN_IN_MADE] if makers(TOGETHER, "motion") else []),
    *map(seen_apart, makers(APART, "motion")),
]
MOTION_SCORES = [
    *([MADE_SCORES] if makers(TOGETHER, "motion") else []),
    *([UNIT_SCORES] if "motion" in BRINGS else []),
    *(scores_apart(name) for name in APART if name in ANIMATED),
]

# How a synthesised record is compared with the actual one.
SCORING = {
    "gestures": tuple(config["phrases"]["gesture"]["labels"]),
    "bins_s": tuple(config["evaluation"]["bins_s"]),
    "max_duration_s": config["synthesis"]["max_duration_s"],
    "tolerance_s": config["evaluation"]["boundary_tolerance_s"],
    **config["evaluation"]["interior"],
    "frame_s": config["speech"]["frame_s"],
}


rule record_scores:
    input:
        actual=expand(f"{RESULTS}/phrases/gesture/{{record}}.parquet", record=RECORDS),
        planned=[path for table in PLANNED_TABLES_OF for path in expand(table, record=RECORDS)],
        seen_draws=[path for table in SEEN_TABLES_OF for path in expand(table, record=RECORDS)],
        motion=[path for table in MOTION_SCORES for path in expand(table, record=RECORDS)],
        swept=expand(f"{RESULTS}/evaluation/swept/{{record}}.parquet", record=RECORDS if SWEEP else []),
        seen=[path for system in SEEN for path in expand(made_by(system, "phrases_seen.parquet"), record=RECORDS)],
    output:
        scores=f"{RESULTS}/evaluation/record_scores.parquet",
    params:
        actors={record: actor_of(record) for record in RECORDS},
        apart=[
            (system, variant_of(system), record, "planned" if SYSTEMS[system].makes == "phrases" else "seen")
            for system in APART
            for record in RECORDS
        ],
        seen=[(system, variant_of(system), record) for system in SEEN for record in RECORDS],
        decoders={name: system.decoder for name, system in SYSTEMS.items() if system.drive != "own"},
        rules=SCORING,
    message:
        f"scores of {len(RECORDS)} records by {len(SYSTEMS)} systems"
    script:
        "../../scripts/evaluation/record_scores.py"


rule session_scores:
    input:
        scores=rules.record_scores.output.scores,
    output:
        scores=f"{RESULTS}/evaluation/session_scores.parquet",
        differences=f"{RESULTS}/evaluation/differences.parquet",
    params:
        main={system: variant_of(system) for system in [*SYSTEMS, ORIGINAL]},
        bootstrap=config["evaluation"]["bootstrap"],
        seed=config["seed"],
    message:
        "scores of synthesis sessions, and differences between systems"
    script:
        "../../scripts/evaluation/session_scores.py"


if "motion" in BRINGS:

    # The systems that make motion and report at which of its frames they start to show a recorded segment.
    DECIDED = [
        system
        for system in makers(ANIMATED_TOGETHER, "motion")
        if SYSTEMS[system].drive == "own" and SYSTEMS[system].reports.get("decisions") == "subunit_decisions"
    ]
    DECISIONS = [path for system in DECIDED for path in expand(made_by(system, "decisions.parquet"), record=RECORDS)]

    rule motion_statistics:
        input:
            original=expand(f"{RESULTS}/motion/{{record}}.parquet", record=RECORDS),
            synthesised=[
                f"{RESULTS}/synthesis/{system}/{variant_of(system)}/{record}/motion.parquet"
                for system in ANIMATED
                for record in RECORDS
            ],
            units=[
                path
                for system in makers(ANIMATED, "phrases")
                for path in expand(made_by(system, "units.parquet"), record=RECORDS)
            ],
            decided=outputs_for(DECISIONS),
        output:
            statistics=f"{RESULTS}/evaluation/motion_statistics.parquet",
            histograms=f"{RESULTS}/evaluation/motion_histograms.parquet",
            quality=f"{RESULTS}/evaluation/motion_quality.parquet",
        params:
            actors={record: actor_of(record) for record in RECORDS},
            animated=[(system, record) for system in ANIMATED for record in RECORDS],
            assembled=[(system, record) for system in makers(ANIMATED, "phrases") for record in RECORDS],
            decided=[(system, record) for system in DECIDED for record in RECORDS],
            decisions=DECISIONS,
            bins=config["evaluation"]["speed_bins"],
        message:
            "speed, acceleration, jerk and faults of original and synthesised motion"
        script:
            "../../scripts/evaluation/motion_statistics.py"


if VIRTUAL:

    # The folds whose prosody clusters are compared with the planted patterns.
    CLUSTERED = [(setting, record) for setting in [MAIN, *SWEEP] for record in RECORDS]

    # The records whose pitch was planted in sound, and measured.
    HEARD = list(RECORDS) if "audio" in BRINGS else []

    rule recovery:
        input:
            gesture_phrases=f"{RESULTS}/corpus/truth/gesture_phrases.parquet",
            prosody_phrases=f"{RESULTS}/corpus/truth/prosody_phrases.parquet",
            transitions=f"{RESULTS}/corpus/truth/transitions.parquet",
            durations=f"{RESULTS}/corpus/truth/durations.parquet",
            gestures=expand(f"{RESULTS}/phrases/gesture/{{record}}.parquet", record=RECORDS),
            clusters=[
                f"{RESULTS}/phrases/prosody/{setting.path}/fold~{fold}/segments.parquet"
                for setting, fold in CLUSTERED
            ],
            planted_prosody=[f"{RESULTS}/corpus/truth/prosody~{record}.parquet" for record in HEARD],
            prosody=[f"{RESULTS}/speech/{record}/prosody.parquet" for record in HEARD],
            pitch=[f"{RESULTS}/speech/{record}/pitch.parquet" for record in HEARD],
            syllables=[f"{RESULTS}/speech/{record}/syllables.parquet" for record in HEARD],
        output:
            recovery=f"{RESULTS}/evaluation/recovery.parquet",
        params:
            actors={record: actor_of(record) for record in RECORDS},
            clustered=[(*setting, fold) for setting, fold in CLUSTERED],
            frame_s=config["speech"]["frame_s"],
            voiced_gain=config["speech"]["voiced_gain"],
            seed=config["seed"],
        message:
            "how much of what was planted is found again"
        script:
            "../../scripts/evaluation/recovery.py"


# Where all records are filmed, their scores are compared with those from the true joint angles.
if ALL_FILMED:

    rule true_angles:
        input:
            motion=lambda wildcards: expand(
                f"{RESULTS}/corpus/truth/motion~{{record}}.parquet",
                record=records_of(wildcards.actor),
            ),
            annotations=lambda wildcards: expand(
                f"{RESULTS}/corpus/annotations/{{record}}.parquet",
                record=records_of(wildcards.actor),
            ),
            prosody=lambda wildcards: expand(
                f"{RESULTS}/phrases/prosody/{MAIN.path}/fold~{{record}}/segments.parquet",
                record=records_of(wildcards.actor),
            ),
        output:
            scores=f"{RESULTS}/evaluation/true_angles/{{actor}}.parquet",
        params:
            records=lambda wildcards: records_of(wildcards.actor),
            settings=config["phrases"]["gesture"],
            system=SHOWN,
            variant=variant_of(SHOWN),
            symbols=list(prosody_labels(MAIN.clusters)),
            shared=SHARED_SETTINGS,
            own=own_settings([SHOWN]),
            seed=config["seed"],
            method_code=code_hash.modules_hash([SYSTEMS[SHOWN].method]),
            frame_s=config["speech"]["frame_s"],
            rules=SCORING,
        message:
            "what the true joint angles of {wildcards.actor} give"
        script:
            "../../scripts/evaluation/true_angles.py"

    rule film_effect:
        input:
            filmed=rules.record_scores.output.scores,
            true=expand(f"{RESULTS}/evaluation/true_angles/{{actor}}.parquet", actor=ACTORS),
        output:
            effect=f"{RESULTS}/evaluation/film_effect.parquet",
        params:
            bootstrap=config["evaluation"]["bootstrap"],
            seed=config["seed"],
        message:
            "scores from film, compared with those from the true joint angles"
        script:
            "../../scripts/evaluation/film_effect.py"

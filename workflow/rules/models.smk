# Systems trained on all of an actor's records, for speech that is in no corpus; and one actor's model under another
# actor's voice.

VARIANTS = {setting.variant: setting for setting in [MAIN, *SWEEP]} | {"main": MAIN}

# Whoever knows the truth cannot be given new speech.
MODELLED = [name for name, system in SYSTEMS.items() if system.drive == "own" and "truth" not in system.needs]


def trained_on(wildcards):
    """The actor of a model, the records it is trained on, and the record it leaves out (None: none)."""
    if wildcards.trained.startswith("fold~"):
        held_out = wildcards.trained.removeprefix("fold~")
        return actor_of(held_out), others(held_out), held_out
    return wildcards.trained, records_of(wildcards.trained), None


def gestures_of_model(wildcards):
    actor, records, held_out = trained_on(wildcards)
    if held_out:
        return f"{RESULTS}/phrases/gesture/fold~{held_out}/segments.parquet"
    return expand(f"{RESULTS}/phrases/gesture/{{record}}.parquet", record=records)


def place_of_model(wildcards):
    """The name of the files that were learnt from the records that a model is trained on."""
    actor, _, held_out = trained_on(wildcards)
    return f"fold~{held_out}" if held_out else f"actor~{actor}"


def gesture_model(wildcards):
    """The model that finds gesture phrases in motion."""
    return f"{RESULTS}/phrases/gesture/{place_of_model(wildcards)}/model.parquet"


def segmented(need, paths):
    """The phases or subunits that a model learns from, where its system needs them.

    The job that trains the model of the gesture phrases, which is an input, writes them.
    """

    def of_model(wildcards):
        needs = need in SYSTEMS[wildcards.system].needs
        return paths(place_of_model(wildcards)) if needs else {}

    return of_model


def clusters_of_model(wildcards):
    """The segments of the prosody clusters that a model listens to; the clusters' own model lies next to them."""
    place = place_of_model(wildcards)
    return f"{RESULTS}/phrases/prosody/{VARIANTS[wildcards.variant].path}/{place}/segments.parquet"


def for_model(path, need=None):
    """The paths of one kind of table of the records that a model is trained on, where its system needs them."""

    def paths(wildcards):
        wanted = need is None or need in SYSTEMS[wildcards.system].needs
        return expand(path, record=trained_on(wildcards)[1]) if wanted else []

    return paths


# A model of all records needs prosody clusters of all records.
rule prosody_clusters_actor:
    input:
        prosody=lambda wildcards: expand(
            f"{RESULTS}/speech/{{record}}/prosody.parquet",
            record=records_of(wildcards.actor),
        ),
    output:
        segments=f"{RESULTS}/phrases/prosody/clusters~{{clusters}}/states~{{states}}/actor~{{actor}}/segments.parquet",
    params:
        records=lambda wildcards: records_of(wildcards.actor),
        training=lambda wildcards: records_of(wildcards.actor),
        setting=lambda wildcards: (int(wildcards.clusters), int(wildcards.states)),
        settings=config["phrases"]["prosody"],
        frame_s=config["speech"]["frame_s"],
        seed=config["seed"],
    message:
        "prosody clusters of {wildcards.actor}"
    script:
        "../../scripts/segmentation/prosody_clusters.py"


if BRINGS >= {"motion", "audio"}:
    MODELS += [f"{RESULTS}/models/{system}/{variant_of(system)}/{actor}" for system in MODELLED for actor in ACTORS]

    rule model:
        input:
            gestures=gestures_of_model,
            gesture_model=gesture_model,
            clusters=clusters_of_model,
            motions=for_model(f"{RESULTS}/motion/{{record}}.parquet"),
            prosody=for_model(f"{RESULTS}/speech/{{record}}/prosody.parquet", "prosody"),
            syllables=for_model(f"{RESULTS}/speech/{{record}}/syllables.parquet", "syllables"),
        output:
            folder=directory(f"{RESULTS}/models/{{system}}/{{variant}}/{{trained}}"),
        wildcard_constraints:
            variant="|".join(VARIANTS),
            trained=f"(fold~)?{record_list.NAME}",
        params:
            actor=lambda wildcards: trained_on(wildcards)[0],
            records=lambda wildcards: trained_on(wildcards)[1],
            held_out=lambda wildcards: trained_on(wildcards)[2],
            order=lambda wildcards: records_of(trained_on(wildcards)[0]),
            phases=segmented("phases", phases_of),
            subunits=segmented("subunits", subunits_of),
            symbols=lambda wildcards: list(prosody_labels(VARIANTS[wildcards.variant].clusters)),
            labels=config["phrases"]["gesture"]["labels"],
            shared=SHARED_SETTINGS,
            own=lambda wildcards: own_settings([wildcards.system]),
            frame_s=config["speech"]["frame_s"],
            method_code=lambda wildcards: code_hash.modules_hash([SYSTEMS[wildcards.system].method]),
            card={
                "speech": config["speech"],
                "seed": config["seed"],
                **{key: ANIMATION[key] for key in ("continuity_weight", "smoothing")},
            },
        message:
            "model of {wildcards.system}, {wildcards.variant}, for {wildcards.trained}"
        script:
            "../../scripts/synthesis/model.py"

    rule transplant:
        input:
            model=f"{RESULTS}/models/{SHOWN}/{variant_of(SHOWN)}/{{actor}}",
            audio=f"{RESULTS}/corpus/audio/{{record}}.wav",
            own=f"{RESULTS}/motion/{{record}}.parquet",
        output:
            phrases=f"{RESULTS}/transplant/{{actor}}/{{record}}/phrases.parquet",
            motion=f"{RESULTS}/transplant/{{actor}}/{{record}}/motion.parquet",
            bvh=f"{RESULTS}/transplant/{{actor}}/{{record}}/motion.bvh",
        params:
            seed=config["seed"],
            method_code=code_hash.modules_hash([SYSTEMS[SHOWN].method]),
        message:
            "{wildcards.record}, driven through the model of {wildcards.actor}"
        script:
            "../../scripts/synthesis/transplant.py"

    rule transplant_comparison:
        input:
            motions=[
                f"{RESULTS}/motion/{{record}}.parquet",
                made_by(SHOWN, "motion.parquet"),
                f"{RESULTS}/transplant/{{actor}}/{{record}}/motion.parquet",
            ],
            phrases=[
                f"{RESULTS}/phrases/gesture/{{record}}.parquet",
                made_by(SHOWN, shown_phrases(SHOWN)),
                f"{RESULTS}/transplant/{{actor}}/{{record}}/phrases.parquet",
            ],
            head=[],
            audio=f"{RESULTS}/corpus/audio/{{record}}.wav",
            shot=[],
        output:
            video=f"{RESULTS}/transplant/{{actor}}/{{record}}/comparison.mp4",
        params:
            settings=FILM,
            headless=[False] * 3,
            titles=lambda wildcards: ["original", "own model", f"model of {wildcards.actor}"],
        message:
            "video of {wildcards.record}: original, own model, model of {wildcards.actor}"
        script:
            "../../scripts/rendering/comparison.py"

    rule transplants:
        input:
            own=[expand(made_by(SHOWN, shown_phrases(SHOWN)), record=record)[0] for _, record in TRANSPLANTS],
            transplanted=[f"{RESULTS}/transplant/{actor}/{record}/phrases.parquet" for actor, record in TRANSPLANTS],
        output:
            table=f"{RESULTS}/evaluation/transplant.parquet",
        params:
            pairs=[(actor, actor_of(record), record) for actor, record in TRANSPLANTS],
            system=SHOWN,
            variant=variant_of(SHOWN),
            frame_s=config["speech"]["frame_s"],
        message:
            "one actor's model under another actor's voice"
        script:
            "../../scripts/evaluation/transplants.py"

    if VIRTUAL and "controller_offline" in SYSTEMS:
        # The last record is spoken by another actor, if there are several.
        SPOKEN = list(RECORDS)[-1]

        rule controller_libraries:
            input:
                model=f"{RESULTS}/models/controller/{variant_of('controller')}/{ACTORS[0]}",
                libraries=LIBRARIES,
                syllables=f"{RESULTS}/speech/{SPOKEN}/syllables.parquet",
                motion=f"{RESULTS}/motion/{SPOKEN}.parquet",
            output:
                table=f"{RESULTS}/evaluation/controller_libraries.parquet",
                strips=f"{RESULTS}/evaluation/controller_strips.parquet",
            params:
                record=SPOKEN,
                times_s=[2.0 + 1.5 * picture for picture in range(8)],
                frame_s=config["speech"]["frame_s"],
                method_code=code_hash.modules_hash([SYSTEMS["controller"].method]),
            message:
                f"controllers with {len(LIBRARIES)} motion libraries"
            script:
                "../../scripts/synthesis/controller_libraries.py"

# From phrases to moving bodies: motion tables and BVH, videos with sound, pictures for the report.

FILM = {key: ANIMATION["video"][key] for key in ("fps", "height_px", "longest_s")}
SOUND = f"{RESULTS}/corpus/audio/{{record}}.wav" if "audio" in BRINGS else []


def shot_of(wildcards):
    """Which of the studio's five films is shown next to a figure: the one from the front, if the record was filmed."""
    record = wildcards.record
    return f"{RESULTS}/corpus/raw/{record}/c3.mkv" if VIRTUAL and record in FILMED_RECORDS else []


# The head that bodies show which make none of their own.
HEAD_SHOWN = made_by(NODDING, "head.parquet") if NODDING else []


def headless(systems):
    """Which bodies make no head of their own: among the original and those of systems, those of recorded gestures."""
    return [False, *(SYSTEMS[system].makes == "phrases" for system in systems)]


def training_motions(wildcards):
    """The motion of the records that a fold may take its units from."""
    return [f"{RESULTS}/motion/{other}.parquet" for other in others(wildcards.record)]


def training_records(wildcards):
    return others(wildcards.record)


def motion_inputs(systems):
    """What the motion of these systems is made from: their phrases, or the motion that they made themselves."""
    return {
        "phrases": [made_by(system, "phrases.parquet") for system in makers(systems, "phrases")],
        "made": [made_by(system, "motion.parquet") for system in makers(systems, "motion")],
        "gestures": f"{RESULTS}/phrases/gesture/fold~{{record}}/segments.parquet",
        "model": f"{RESULTS}/phrases/gesture/fold~{{record}}/model.parquet",
        "motions": training_motions,
        "own": f"{RESULTS}/motion/{{record}}.parquet",
        "spoken": SPOKEN_SYLLABLES,
    }


def motion_outputs(systems):
    """The motion of these systems, and the phrases that are seen in it."""
    planned = makers(systems, "phrases")
    return {
        "units": [made_by(system, "units.parquet") for system in planned],
        "motion": [made_by(system, "motion.parquet") for system in planned],
        "bvh": [made_by(system, "motion.bvh") for system in [*planned, *makers(systems, "motion")]],
        "seen": [made_by(system, "phrases_seen.parquet") for system in [*planned, *makers(systems, "motion")]],
    }


def motion_params(systems):
    return {
        "planned": [(system, variant_of(system)) for system in makers(systems, "phrases")],
        "making": makers(systems, "motion"),
        "settings": {key: ANIMATION[key] for key in ("continuity_weight", "smoothing")},
        "others": training_records,
        "interior": config["evaluation"]["interior"],
    }


if "motion" in BRINGS:

    # All systems of a record in one process: they share the templates, and a start costs more than a system.
    rule motion:
        input:
            **motion_inputs(ANIMATED_TOGETHER),
        output:
            **motion_outputs(ANIMATED_TOGETHER),
            original=f"{RESULTS}/synthesis/{ORIGINAL}/main/{{record}}/phrases_seen.parquet",
            scores=UNIT_SCORES,
        params:
            **motion_params(ANIMATED_TOGETHER),
        message:
            "motion of {wildcards.record} from the gestures of the training records"
        script:
            "../../scripts/rendering/motion.py"

    for name in APART:
        animated = [system for system in ANIMATED_APART if SYSTEMS[system].decoder == name]
        if not animated:
            continue

        rule:
            name:
                f"motion_{name}"
            input:
                **motion_inputs(animated),
            output:
                **motion_outputs(animated),
                original=[],
                scores=scores_apart(name) if SYSTEMS[name].makes == "phrases" else [],
            params:
                **motion_params(animated),
            message:
                f"motion of {{wildcards.record}} by {', '.join(animated)}"
            script:
                "../../scripts/rendering/motion.py"

    rule video:
        input:
            motion=f"{RESULTS}/synthesis/{{system}}/{{variant}}/{{record}}/motion.parquet",
            phrases=f"{RESULTS}/synthesis/{{system}}/{{variant}}/{{record}}/phrases_seen.parquet",
            audio=SOUND,
        output:
            video=f"{RESULTS}/synthesis/{{system}}/{{variant}}/{{record}}/motion.mp4",
        params:
            settings=FILM,
        message:
            "video of {wildcards.record} by {wildcards.system}"
        script:
            "../../scripts/rendering/video.py"

    rule comparison:
        input:
            motions=[
                f"{RESULTS}/motion/{{record}}.parquet",
                *(made_by(system, "motion.parquet") for system in COMPARED),
            ],
            phrases=[
                f"{RESULTS}/phrases/gesture/{{record}}.parquet",
                *(made_by(system, shown_phrases(system)) for system in COMPARED),
            ],
            head=HEAD_SHOWN,
            audio=SOUND,
            shot=shot_of,
        output:
            video=f"{RESULTS}/animation/{{record}}/comparison.mp4",
        params:
            settings=FILM,
            headless=headless(COMPARED),
            titles=lambda wildcards: ["captured" if shot_of(wildcards) else "original", *COMPARED],
        message:
            f"video of {{wildcards.record}}: original, {', '.join(COMPARED)} side by side"
        script:
            "../../scripts/rendering/comparison.py"

    # On request: the same seconds of a record in each version, without labels, for perception studies.
    rule survey_clips:
        input:
            motions=[
                f"{RESULTS}/motion/{{record}}.parquet",
                *(made_by(system, "motion.parquet") for system in COMPARED),
            ],
            phrases=f"{RESULTS}/phrases/gesture/{{record}}.parquet",
            audio=SOUND,
        output:
            folder=directory(f"{RESULTS}/survey/{{record}}"),
        params:
            settings=FILM,
            versions=[ORIGINAL, *COMPARED],
        message:
            f"clips of {{wildcards.record}}: original, {', '.join(COMPARED)}"
        script:
            "../../scripts/rendering/survey_clips.py"

    # What the 3D viewer shows next to the original: the animated systems, driven by the right speech.
    VIEWED = [name for name in ANIMATED if SYSTEMS[name].drive == "own"]

    rule viewer:
        input:
            motions=[
                f"{RESULTS}/motion/{{record}}.parquet",
                *(made_by(system, "motion.parquet") for system in VIEWED),
            ],
            phrases=[
                f"{RESULTS}/phrases/gesture/{{record}}.parquet",
                *(made_by(system, shown_phrases(system)) for system in VIEWED),
            ],
            head=HEAD_SHOWN,
            audio=SOUND,
            pitch=f"{RESULTS}/speech/{{record}}/pitch.parquet" if "audio" in BRINGS else [],
        output:
            script=f"{REPORTS}/viewer/{{record}}.js",
        params:
            titles=["Original", *(SYSTEMS[system].title for system in VIEWED)],
            shown=[True, *(system in COMPARED for system in VIEWED)],
            headless=headless(VIEWED),
            head_by=HEADS[NODDING].title if NODDING else None,
        message:
            "{wildcards.record} for the 3D viewer"
        script:
            "../../scripts/rendering/viewer.py"

    rule stills:
        input:
            motions=expand(f"{RESULTS}/motion/{{record}}.parquet", record=RECORDS),
            phrases=expand(f"{RESULTS}/phrases/gesture/{{record}}.parquet", record=RECORDS),
            shots=expand(f"{RESULTS}/corpus/raw/{{record}}/c3.mkv", record=RECORDS if ALL_FILMED else []),
        output:
            picture=f"{RESULTS}/animation/stills.png",
            table=f"{RESULTS}/animation/stills.parquet",
        params:
            records=list(RECORDS),
            labels=config["phrases"]["gesture"]["labels"],
        message:
            "typical pictures of the gesture classes"
        script:
            "../../scripts/rendering/stills.py"

    # A record of each actor, as far as their rows fit a page.
    STRIPPED = FIRST_RECORDS[:3]

    rule strip:
        input:
            motions=expand(made_by(SHOWN, "motion.parquet"), record=STRIPPED),
            phrases=expand(made_by(SHOWN, shown_phrases(SHOWN)), record=STRIPPED),
        output:
            picture=f"{RESULTS}/animation/strip.png",
        params:
            system=SHOWN,
            records=STRIPPED,
        message:
            f"frames of the animation by {SHOWN}"
        script:
            "../../scripts/rendering/strip.py"

    # Smoothing is tried where units meet: on a system whose phrases unit selection turned into motion.
    TRIED = FIRST_RECORDS[0]
    SELECTED = next(name for name in [SHOWN, *RELIABLE_FIRST] if SYSTEMS[name].makes == "phrases")

    rule smoothing:
        input:
            units=expand(made_by(SELECTED, "units.parquet"), record=TRIED)[0],
            made=expand(made_by(SELECTED, "motion.parquet"), record=TRIED)[0],
            gestures=f"{RESULTS}/phrases/gesture/fold~{TRIED}/segments.parquet",
            motions=expand(f"{RESULTS}/motion/{{record}}.parquet", record=others(TRIED)),
        output:
            table=f"{RESULTS}/animation/smoothing.parquet",
        params:
            window=ANIMATION["smoothing"]["window"],
            system=SELECTED,
            record=TRIED,
            others=others(TRIED),
        message:
            "a joint angle under each smoothing filter"
        script:
            "../../scripts/rendering/smoothing.py"

# From phrases to moving bodies: motion tables and BVH, videos with sound, pictures for the report.

ANIMATION = config["animation"]
SHOWN = ANIMATION["video"]["shown"]
FILM = {key: ANIMATION["video"][key] for key in ("fps", "height_px", "longest_s")}
SOUND = f"{RESULTS}/corpus/audio/{{record}}.wav" if "audio" in BRINGS else []

# What is shown of the studio's five films beside a figure: the one from the front.
SHOT = f"{RESULTS}/corpus/raw/{{record}}/c3.mkv" if VIRTUAL and FILMED else []


def of_system(system, name):
    """The path of one artifact of a system at the main setting."""
    return f"{RESULTS}/synthesis/{system}/{MAIN.path}/{{record}}/{name}"


def training_motions(wildcards):
    """The motion of the records that a fold may take its units from."""
    return [f"{RESULTS}/motion/{other}.parquet" for other in others(wildcards.record)]


def training_records(wildcards):
    return others(wildcards.record)


if "motion" in BRINGS:

    # All systems of a record in one process: they share the templates, and a start costs more than a system.
    rule motion:
        input:
            phrases=[of_system(system, "phrases.parquet") for system in ANIMATION["systems"]],
            gestures=f"{RESULTS}/phrases/gesture/fold~{{record}}/segments.parquet",
            motions=training_motions,
            own=f"{RESULTS}/motion/{{record}}.parquet",
        output:
            units=[of_system(system, "units.parquet") for system in ANIMATION["systems"]],
            motion=[of_system(system, "motion.parquet") for system in ANIMATION["systems"]],
            bvh=[of_system(system, "motion.bvh") for system in ANIMATION["systems"]],
        params:
            settings={key: ANIMATION[key] for key in ("systems", "continuity_weight", "smoothing")},
            others=training_records,
        message:
            "motion of {wildcards.record} from the gestures of the training records"
        script:
            "../../scripts/rendering/motion.py"

    rule video:
        input:
            motion=of_system("{system}", "motion.parquet"),
            phrases=of_system("{system}", "phrases.parquet"),
            audio=SOUND,
        output:
            video=of_system("{system}", "motion.mp4"),
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
                of_system(SHOWN, "motion.parquet"),
                of_system("random", "motion.parquet"),
            ],
            phrases=[
                f"{RESULTS}/phrases/gesture/{{record}}.parquet",
                of_system(SHOWN, "phrases.parquet"),
                of_system("random", "phrases.parquet"),
            ],
            audio=SOUND,
            shot=SHOT,
        output:
            video=f"{RESULTS}/animation/{{record}}/comparison.mp4",
        params:
            settings=FILM,
            titles=["captured" if SHOT else "original", SHOWN, "random"],
        message:
            f"video of {{wildcards.record}}: original, {SHOWN} and random side by side"
        script:
            "../../scripts/rendering/comparison.py"

    rule stills:
        input:
            motions=expand(f"{RESULTS}/motion/{{record}}.parquet", record=RECORDS),
            phrases=expand(f"{RESULTS}/phrases/gesture/{{record}}.parquet", record=RECORDS),
            shots=expand(SHOT, record=RECORDS),
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

    rule strip:
        input:
            motions=expand(of_system(SHOWN, "motion.parquet"), record=FIRST_RECORDS),
            phrases=expand(of_system(SHOWN, "phrases.parquet"), record=FIRST_RECORDS),
        output:
            picture=f"{RESULTS}/animation/strip.png",
        params:
            system=SHOWN,
            records=FIRST_RECORDS,
        message:
            f"frames of the animation by {SHOWN}"
        script:
            "../../scripts/rendering/strip.py"

    TRIED = FIRST_RECORDS[0]

    rule smoothing:
        input:
            units=expand(of_system(SHOWN, "units.parquet"), record=TRIED)[0],
            made=expand(of_system(SHOWN, "motion.parquet"), record=TRIED)[0],
            gestures=f"{RESULTS}/phrases/gesture/fold~{TRIED}/segments.parquet",
            motions=expand(f"{RESULTS}/motion/{{record}}.parquet", record=others(TRIED)),
        output:
            table=f"{RESULTS}/animation/smoothing.parquet",
        params:
            window=ANIMATION["smoothing"]["window"],
            system=SHOWN,
            record=TRIED,
            others=others(TRIED),
        message:
            "a joint angle under each smoothing filter"
        script:
            "../../scripts/rendering/smoothing.py"

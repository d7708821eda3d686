# The virtual studio: one script sampled for all records, then one take per record, with sound and motion or, to
# simulate hours of speech in seconds, without sound.


# The synthesiser voice of each actor.
VOICES = {actor["actor"]: actor["voice"] for actor in config["studio"]["actors"]} if VIRTUAL else {}


def voice_of(wildcards):
    """The synthesiser voice of the actor of a record."""
    return VOICES[actor_of(wildcards.record)]


def performer_of(wildcards):
    """The actor of a record."""
    return actor_of(wildcards.record)


def scenario_of(wildcards):
    """What the actor was asked to do in a record."""
    return RECORDS[wildcards.record]["scenario"]


# What is planted in records and in their actors: all that some actor's world needs. Only the world `phrases` has nothing
# but the script.
WORLDS = configuration.actor_worlds(config["studio"]) if VIRTUAL else {}
HAS_AROUSAL = any(own.world in ("vigour", "all") for own in WORLDS.values())
HAS_SUBUNITS = any(own.world in ("syllables", "all") for own in WORLDS.values())
HAS_SYLLABLES = any(own.world != "phrases" for own in WORLDS.values())
HAS_HEADS = any(own.world == "patterns" or own.head is not None for own in WORLDS.values())
PLANTED_IN_RECORDS = [
    "gesture_phrases",
    "prosody_phrases",
    *(["syllables"] if HAS_SYLLABLES else []),
    *(["arousal_speech", "arousal_hands"] if HAS_AROUSAL else []),
    *(["subunits"] if HAS_SUBUNITS else []),
    *(["melody_patterns", "head_patterns", "head_joints"] if HAS_HEADS else []),
]
PLANTED_OF_ACTORS = [
    "initial",
    "transitions",
    "emissions",
    "durations",
    "annotations",
    *(["arousal_states"] if HAS_AROUSAL else []),
    *(["subunit_kinds", "subunit_transitions", "subunit_preferences"] if HAS_SUBUNITS else []),
    *(["head_habits"] if HAS_HEADS else []),
]


def planted(names):
    """The paths of tables that the script plants, by name."""
    return {name: f"{RESULTS}/corpus/truth/{name}.parquet" for name in names}


rule studio_script:
    output:
        **planted([*PLANTED_IN_RECORDS, *PLANTED_OF_ACTORS]),
    params:
        records={actor: records_of(actor) for actor in ACTORS},
        durations_s={actor["actor"]: actor["duration_s"] for actor in config["studio"]["actors"]},
        worlds={actor: tuple(own) for actor, own in WORLDS.items()},
        examples=config["studio"]["examples"],
        frame_s=config["speech"]["frame_s"],
        max_duration_s=config["synthesis"]["max_duration_s"],
        seed=config["seed"],
    message:
        "sample the script of all records"
    script:
        "../../scripts/studio/studio_script.py"


rule studio_take:
    input:
        **planted(PLANTED_IN_RECORDS),
    output:
        **({"head": f"{RESULTS}/corpus/truth/head~{{record}}.parquet"} if HAS_HEADS else {}),
        sound=f"{RESULTS}/corpus/raw/{{record}}.wav",
        bvh=f"{RESULTS}/corpus/raw/{{record}}.bvh",
        motion=f"{RESULTS}/corpus/truth/motion~{{record}}.parquet",
        prosody=f"{RESULTS}/corpus/truth/prosody~{{record}}.parquet",
    params:
        planted=PLANTED_IN_RECORDS,
        heads=HAS_HEADS,
        actor=performer_of,
        voice=voice_of,
        scenario=scenario_of,
        motion_fps=config["studio"]["motion_fps"],
        motion_noise_deg=config["studio"]["motion_noise_deg"],
        frame_s=config["speech"]["frame_s"],
        seed=config["seed"],
    message:
        "record the voice and motion of {wildcards.record}"
    script:
        "../../scripts/studio/studio_take.py"


# Simulating a record takes less than starting a process, so the records of an actor share one, and a folder.
if VIRTUAL and "audio" not in BRINGS:

    rule studio_features:
        input:
            **planted(PLANTED_IN_RECORDS),
        output:
            features=directory(f"{RESULTS}/corpus/raw/{{actor}}"),
        params:
            planted=PLANTED_IN_RECORDS,
            actor="{actor}",
            records=lambda wildcards: records_of(wildcards.actor),
            voice=lambda wildcards: VOICES[wildcards.actor],
            motion_fps=config["studio"]["motion_fps"] if "motion" in BRINGS else None,
            head_fps=config["studio"]["motion_fps"],
            motion_noise_deg=config["studio"]["motion_noise_deg"],
            frame_s=config["speech"]["frame_s"],
            voiced_gain=config["speech"]["voiced_gain"],
            seed=config["seed"],
        message:
            "simulate the speech of {wildcards.actor} without sound"
        script:
            "../../scripts/studio/studio_features.py"


# Motion libraries in the situations of Levine et al. 2010, table 1; no other rule needs them.
LIBRARIES = expand(f"{RESULTS}/libraries/{{library}}", library=config["studio"]["libraries"])


rule studio_library:
    output:
        library=directory(f"{RESULTS}/libraries/{{library}}"),
    params:
        duration_s=lambda wildcards: config["studio"]["libraries"][wildcards.library],
        fps=config["studio"]["motion_fps"],
        motion_noise_deg=config["studio"]["motion_noise_deg"],
        seed=config["seed"],
    message:
        "motion library {wildcards.library}"
    script:
        "../../scripts/studio/studio_library.py"


if VIRTUAL and FILMED:

    rule studio_rig:
        output:
            cameras=f"{RESULTS}/corpus/truth/cameras.parquet",
        params:
            width_px=config["studio"]["camera_width_px"],
            seed=config["seed"],
        message:
            "set up the cameras of the studio"
        script:
            "../../scripts/studio/studio_rig.py"

    rule studio_laser:
        input:
            cameras=rules.studio_rig.output.cameras,
        output:
            films=[f"{RESULTS}/corpus/raw/laser/{view}.mkv" for view in VIEWS],
            laser=f"{RESULTS}/corpus/truth/laser.parquet",
        params:
            seed=config["seed"],
        message:
            "film the calibration take"
        script:
            "../../scripts/studio/studio_laser.py"

    rule studio_range:
        input:
            cameras=rules.studio_rig.output.cameras,
        output:
            films=[f"{RESULTS}/corpus/raw/range~{{actor}}/{view}.mkv" for view in VIEWS],
            motion=f"{RESULTS}/corpus/truth/motion_range~{{actor}}.parquet",
            markers_2d=f"{RESULTS}/corpus/truth/markers_2d_range~{{actor}}.parquet",
            markers_3d=f"{RESULTS}/corpus/truth/markers_3d_range~{{actor}}.parquet",
        params:
            motion_fps=config["studio"]["motion_fps"],
            seed=config["seed"],
        message:
            "film the range-of-motion take of {wildcards.actor}"
        script:
            "../../scripts/studio/studio_range.py"

    rule studio_film:
        input:
            motion=rules.studio_take.output.motion,
            cameras=rules.studio_rig.output.cameras,
        output:
            films=[f"{RESULTS}/corpus/raw/{{record}}/{view}.mkv" for view in VIEWS],
            markers_2d=f"{RESULTS}/corpus/truth/markers_2d~{{record}}.parquet",
            markers_3d=f"{RESULTS}/corpus/truth/markers_3d~{{record}}.parquet",
        params:
            actor=performer_of,
            seed=config["seed"],
        message:
            "film {wildcards.record}"
        script:
            "../../scripts/studio/studio_film.py"


# The calibration of the stereo camera comes as a camera file, like that of a user.
if VIRTUAL and config["studio"]["film"] == "stereo":

    rule studio_stereo:
        output:
            cameras=f"{RESULTS}/corpus/raw/stereo.toml",
            truth=f"{RESULTS}/corpus/truth/stereo.parquet",
        params:
            width_px=config["studio"]["stereo_width_px"],
        message:
            "set up the stereo camera of the studio"
        script:
            "../../scripts/studio/studio_stereo.py"

    rule studio_head:
        input:
            sound=rules.studio_take.output.sound,
            poses=rules.studio_take.output.head,
            cameras=rules.studio_stereo.output.truth,
        output:
            films=[f"{RESULTS}/corpus/raw/{{record}}/{view}.mkv" for view in ("left", "right")],
        params:
            actor=performer_of,
            seed=config["seed"],
        message:
            "film the head in {wildcards.record}"
        script:
            "../../scripts/studio/studio_head.py"

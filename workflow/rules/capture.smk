# From films or markers to joint angles: markers in every view and in the world, then the body that carries them.


def films_of(wildcards):
    """The films of a take, one of each camera."""
    return TAKES[wildcards.take]


def marker_file_of(wildcards):
    """The file of another system that holds the markers of a take."""
    return TAKES[wildcards.take][0]


def sound_of(wildcards):
    """The record's own sound, which a range-of-motion take has none of."""
    audio = RECORDS.get(wildcards.take, {}).get("audio")
    return [audio] if audio else []


def by_hand(kind):
    """The file of clicks or corrections of a take, where a person made one."""

    def given(wildcards):
        folder = config["capture"][kind]
        path = Path(folder or "", f"{wildcards.take}.csv")
        return [str(path)] if folder and path.is_file() else []

    return given


def range_of_motion(wildcards):
    """The markers of the range-of-motion take of the record's actor."""
    return f"{RESULTS}/capture/range~{actor_of(wildcards.record)}/markers_3d.parquet"


if FILMED:

    rule offsets:
        input:
            films=films_of,
            sound=sound_of,
        output:
            offsets=f"{RESULTS}/capture/{{take}}/offsets.parquet",
        log:
            f"{RESULTS}/logs/offsets/{{take}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/offsets/{{take}}.tsv"
        wildcard_constraints:
            take="|".join(FILMED),
        params:
            given_s=lambda wildcards: configuration.offsets_s(config, wildcards.take),
            corpus=config["corpus"]["name"],
            code=code("capture/offsets"),
        message:
            "how far the films of {wildcards.take} are out of step"
        script:
            "../../scripts/capture/offsets.py"

    rule track:
        input:
            cameras=rules.calibrate.output.cameras,
            calibration=rules.calibrate.input.take,
            films=films_of,
            # The studio's films are in step.
            offsets=[] if VIRTUAL else f"{RESULTS}/capture/{{take}}/offsets.parquet",
            clicks=by_hand("clicks"),
            corrections=by_hand("corrections"),
        output:
            views=f"{RESULTS}/capture/{{take}}/markers_2d.parquet",
            world=f"{RESULTS}/capture/{{take}}/markers_3d.parquet",
            spans=f"{RESULTS}/capture/{{take}}/marker_spans.parquet",
        log:
            f"{RESULTS}/logs/track/{{take}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/track/{{take}}.tsv"
        wildcard_constraints:
            take="|".join(FILMED),
        params:
            settings=config["capture"]["track"],
            corpus=config["corpus"]["name"],
            code=code("capture/track"),
        message:
            "markers of {wildcards.take} in every view and in the world"
        script:
            "../../scripts/capture/track.py"


if len(TAKES) > len(FILMED):

    rule marker_file:
        input:
            file=marker_file_of,
        output:
            world=f"{RESULTS}/capture/{{take}}/markers_3d.parquet",
            spans=f"{RESULTS}/capture/{{take}}/marker_spans.parquet",
        log:
            f"{RESULTS}/logs/marker_file/{{take}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/marker_file/{{take}}.tsv"
        wildcard_constraints:
            take="|".join(take for take in TAKES if take not in FILMED),
        params:
            markers=config["corpus"]["markers"],
            longest_hidden_s=config["capture"]["track"]["longest_hidden_s"],
            corpus=config["corpus"]["name"],
            code=code("capture/marker_file"),
        message:
            "markers of {wildcards.take} as another system measured them"
        script:
            "../../scripts/capture/marker_file.py"


if TAKES:

    rule skeleton:
        input:
            take=range_of_motion,
            markers=f"{RESULTS}/capture/{{record}}/markers_3d.parquet",
        output:
            motion=f"{RESULTS}/capture/{{record}}/motion.parquet",
            observability=f"{RESULTS}/capture/{{record}}/observability.parquet",
        log:
            f"{RESULTS}/logs/skeleton/{{record}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/skeleton/{{record}}.tsv"
        params:
            static_s=config["capture"]["static_s"],
            corpus=config["corpus"]["name"],
            code=code("capture/skeleton"),
        message:
            "joint angles of {wildcards.record} from its markers"
        script:
            "../../scripts/capture/skeleton.py"

    rule export_motion:
        input:
            markers=f"{RESULTS}/capture/{{record}}/markers_3d.parquet",
            motion=f"{RESULTS}/capture/{{record}}/motion.parquet",
        output:
            trc=f"{RESULTS}/export/{{record}}.trc",
            c3d=f"{RESULTS}/export/{{record}}.c3d",
            bvh=f"{RESULTS}/export/{{record}}.bvh",
        log:
            f"{RESULTS}/logs/export_motion/{{record}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/export_motion/{{record}}.tsv"
        params:
            corpus=config["corpus"]["name"],
            code=code("capture/export_motion"),
        message:
            "{wildcards.record} as TRC, C3D and BVH"
        script:
            "../../scripts/capture/export_motion.py"

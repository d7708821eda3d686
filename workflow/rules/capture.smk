# From films or marker files to joint angles: markers in every view and in 3D, then the fitted body model.


def films_of(wildcards):
    """The films of a take or record, one per camera."""
    return TAKES[wildcards.get("take") or wildcards.record]


def marker_file_of(wildcards):
    """The marker file of a take, measured by another system."""
    return TAKES[wildcards.take][0]


def sound_of(wildcards):
    """The sound of the record; a range-of-motion take has none."""
    audio = RECORDS.get(wildcards.take, {}).get("audio")
    return [audio] if audio else []


def by_hand(kind):
    """The file of clicks or corrections of a take, if there is one."""

    def given(wildcards):
        folder = config["capture"][kind]
        path = Path(folder or "", f"{wildcards.take}.csv")
        return [str(path)] if folder and path.is_file() else []

    return given


def range_of_motion(wildcards):
    """The markers from the range-of-motion take of the record's actor."""
    return f"{RESULTS}/capture/range~{actor_of(wildcards.record)}/markers_3d.parquet"


def static_pose_of(wildcards):
    """The static pose of the actor's range-of-motion take; in films, the markers are found on hanging arms."""
    return "hanging" if f"range~{actor_of(wildcards.record)}" in FILMED else config["corpus"]["markers"]["static"]


if FILMED:

    rule offsets:
        input:
            films=films_of,
            sound=sound_of,
        output:
            offsets=f"{RESULTS}/capture/{{take}}/offsets.parquet",
        wildcard_constraints:
            take="|".join(FILMED),
        params:
            given_s=lambda wildcards: capture_takes.offsets_s(config, wildcards.take),
        message:
            "synchronise the films of {wildcards.take}"
        script:
            "../../scripts/capture/offsets.py"

    rule track:
        input:
            cameras=rules.calibrate.output.cameras,
            calibration=rules.calibrate.input.take,
            films=films_of,
            # The films of the virtual studio are synchronous.
            offsets=[] if VIRTUAL else f"{RESULTS}/capture/{{take}}/offsets.parquet",
            clicks=by_hand("clicks"),
            corrections=by_hand("corrections"),
        output:
            views=f"{RESULTS}/capture/{{take}}/markers_2d.parquet",
            world=f"{RESULTS}/capture/{{take}}/markers_3d.parquet",
            spans=f"{RESULTS}/capture/{{take}}/marker_spans.parquet",
        wildcard_constraints:
            take="|".join(FILMED),
        params:
            settings=config["capture"]["track"],
        message:
            "track the markers of {wildcards.take}"
        script:
            "../../scripts/capture/track.py"

    # For manual review and correction of the tracking of a record; made only on request.
    MOMENTS = range(1, 7)

    rule worst_moments:
        input:
            cameras=rules.calibrate.output.cameras,
            films=films_of,
            offsets=[] if VIRTUAL else f"{RESULTS}/capture/{{record}}/offsets.parquet",
            views=f"{RESULTS}/capture/{{record}}/markers_2d.parquet",
            world=f"{RESULTS}/capture/{{record}}/markers_3d.parquet",
        output:
            table=f"{RESULTS}/capture/{{record}}/worst_moments.parquet",
            pictures=[f"{RESULTS}/capture/{{record}}/moment_{number}.png" for number in MOMENTS],
        message:
            "worst moments of the tracking of {wildcards.record}"
        script:
            "../../scripts/capture/worst_moments.py"

    rule overlay:
        input:
            cameras=rules.calibrate.output.cameras,
            films=films_of,
            offsets=[] if VIRTUAL else f"{RESULTS}/capture/{{record}}/offsets.parquet",
            views=f"{RESULTS}/capture/{{record}}/markers_2d.parquet",
            world=f"{RESULTS}/capture/{{record}}/markers_3d.parquet",
        output:
            video=f"{RESULTS}/capture/{{record}}/overlay.mp4",
        message:
            "overlay of the films and markers of {wildcards.record}"
        script:
            "../../scripts/capture/overlay.py"


if len(TAKES) > len(FILMED):

    rule marker_file:
        input:
            file=marker_file_of,
        output:
            world=f"{RESULTS}/capture/{{take}}/markers_3d.parquet",
            spans=f"{RESULTS}/capture/{{take}}/marker_spans.parquet",
        wildcard_constraints:
            take="|".join(take for take in TAKES if take not in FILMED),
        params:
            markers=config["corpus"]["markers"],
            # Only a range-of-motion take begins with the static pose.
            static_s=lambda wildcards: config["capture"]["static_s"] if wildcards.take.startswith("range~") else None,
            longest_hidden_s=config["capture"]["track"]["longest_hidden_s"],
        message:
            "import the markers of {wildcards.take}"
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
        params:
            file=lambda wildcards: None if wildcards.record in FILMED else TAKES[wildcards.record][0],
            markers=config["corpus"]["markers"],
            static=static_pose_of,
            static_s=config["capture"]["static_s"],
        message:
            "fit the joint angles of {wildcards.record}"
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
        message:
            "export {wildcards.record} as TRC, C3D and BVH"
        script:
            "../../scripts/capture/export_motion.py"


if VIRTUAL and FILMED:

    # The other of the two tracking methods, for comparison.
    TRACKER = config["capture"]["track"]["method"]
    OTHER = {"robust": "thesis", "thesis": "robust"}[TRACKER]

    use rule track as track_other with:
        output:
            views=f"{RESULTS}/capture/{{take}}/{OTHER}/markers_2d.parquet",
            world=f"{RESULTS}/capture/{{take}}/{OTHER}/markers_3d.parquet",
            spans=f"{RESULTS}/capture/{{take}}/{OTHER}/marker_spans.parquet",
        params:
            settings=config["capture"]["track"] | {"method": OTHER},
        message:
            f"track the markers of {{wildcards.take}} by the method '{OTHER}'"

    # The markers to score against the ground truth: all filmed records by the method in use, the first also by the other.
    TRACKED = [(record, TRACKER, f"{RESULTS}/capture/{record}") for record in FILMED_RECORDS]
    TRACKED += [(record, OTHER, f"{RESULTS}/capture/{record}/{OTHER}") for record in FIRST_RECORDS[:1]]

    rule capture_scores:
        input:
            cameras=rules.calibrate.output.cameras,
            true_cameras=rules.studio_rig.output.cameras,
            spots=rules.studio_laser.output.laser,
            views=[f"{folder}/markers_2d.parquet" for *_, folder in TRACKED],
            world=[f"{folder}/markers_3d.parquet" for *_, folder in TRACKED],
            true_views=expand(f"{RESULTS}/corpus/truth/markers_2d~{{record}}.parquet", record=FILMED_RECORDS),
            true_world=expand(f"{RESULTS}/corpus/truth/markers_3d~{{record}}.parquet", record=FILMED_RECORDS),
            takes=[f"{RESULTS}/capture/range~{actor_of(record)}/markers_3d.parquet" for record in FILMED_RECORDS],
            motion=expand(f"{RESULTS}/capture/{{record}}/motion.parquet", record=FILMED_RECORDS),
            true_motion=expand(f"{RESULTS}/corpus/truth/motion~{{record}}.parquet", record=FILMED_RECORDS),
        output:
            scores=f"{RESULTS}/capture/capture_scores.parquet",
        params:
            records=FILMED_RECORDS,
            tracked=[(record, method) for record, method, _ in TRACKED],
            method=TRACKER,
            static_s=config["capture"]["static_s"],
        message:
            "score the capture against the ground truth"
        script:
            "../../scripts/capture/capture_scores.py"

# From the film of a face, by a stereo camera or a single one, to the pose of the head.

if FILMED_HEADS:

    def head_films_of(wildcards):
        """The films of the face of a record, the left one first."""
        return [
            RECORDS[wildcards.record][view] for view in ("film_left", "film_right") if RECORDS[wildcards.record][view]
        ]

    rule head_pose:
        input:
            films=head_films_of,
            cameras=lambda wildcards: RECORDS[wildcards.record]["film_cameras"] or [],
        output:
            pose=f"{RESULTS}/capture/head/{{record}}/pose.parquet",
        wildcard_constraints:
            record="|".join(FILMED_HEADS),
        params:
            settings=config["capture"]["head"],
            focal_length=lambda wildcards: {key: RECORDS[wildcards.record][key] for key in record_list.FOCAL_LENGTHS},
            most_frames_apart=config["capture"]["track"]["most_frames_apart"],
        message:
            "track the head of {wildcards.record}"
        script:
            "../../scripts/capture/head_pose.py"


if VIRTUAL and FILMED_HEADS:

    # How accurate the capture is where size, contrast and noise of the film are worse.
    rule head_accuracy:
        output:
            accuracy=f"{RESULTS}/capture/head/accuracy.parquet",
        params:
            settings=config["capture"]["head"],
            person=ACTORS[0],
            seed=config["seed"],
            n_frames=36,
        message:
            "capture a virtual head over image size, contrast and noise"
        script:
            "../../scripts/capture/head_accuracy.py"

# From the film of a face to the pose of the head. HEAD_FILMS names the films of each record that has some: those of a
# stereo pair, named after their cameras, or one; HEAD_CAMERAS the calibration, a table or a TOML file, where there is
# one.


def head_films_of(wildcards):
    """The films of the face of a record."""
    return HEAD_FILMS[wildcards.record]


def head_cameras_of(wildcards):
    """The calibration of these films; of a single one a focal length may be declared instead."""
    return HEAD_CAMERAS.get(wildcards.record, [])


if HEAD_FILMS:

    rule head_pose:
        input:
            films=head_films_of,
            cameras=head_cameras_of,
        output:
            pose=f"{RESULTS}/capture/head/{{record}}/pose.parquet",
        wildcard_constraints:
            record="|".join(HEAD_FILMS),
        params:
            settings=config["capture"]["head"],
            most_frames_apart=config["capture"]["track"]["most_frames_apart"],
        message:
            "track the head of {wildcards.record}"
        script:
            "../../scripts/capture/head_pose.py"

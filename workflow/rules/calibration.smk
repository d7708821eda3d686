# The cameras of the rig, from films of a laser spot or a board, or from a camera file.

CALIBRATION = config["capture"]["calibration"]
METHOD = CALIBRATION["method"]
CALIBRATED = FILMED or capture_takes.calibrates(config)
# The films of the calibration take by camera: the user's own, else the studio's; none if a camera file is given.
TAKE_FILMS = OWN_TAKE
if CALIBRATED and not capture_takes.calibrates(config):
    TAKE_FILMS = {view: f"{RESULTS}/corpus/raw/laser/{view}.mkv" for view in VIEWS}
CALIBRATION_OUTPUTS = []

if CALIBRATED and METHOD == "laser":

    rule laser:
        input:
            films=list(TAKE_FILMS.values()),
        output:
            laser=f"{RESULTS}/capture/laser.parquet",
        params:
            most_frames_apart=config["capture"]["track"]["most_frames_apart"],
        message:
            "detect the laser spot in every view"
        script:
            "../../scripts/capture/laser.py"


if CALIBRATED and METHOD == "board":

    rule corners:
        input:
            films=list(TAKE_FILMS.values()),
            board=CALIBRATION["board"],
        output:
            corners=f"{RESULTS}/capture/corners.parquet",
        params:
            most_frames_apart=config["capture"]["track"]["most_frames_apart"],
        message:
            "detect the corners of the board in every view"
        script:
            "../../scripts/capture/corners.py"


if CALIBRATED:

    # The detections in the take, and the board definition, as far as the method needs them.
    DETECTIONS = {
        "laser": {"laser": f"{RESULTS}/capture/laser.parquet"},
        "board": {"corners": f"{RESULTS}/capture/corners.parquet", "board": CALIBRATION["board"]},
        "given": {},
    }

    rule calibrate:
        input:
            **DETECTIONS[METHOD],
            take=list(TAKE_FILMS.values()) or [CALIBRATION["file"]],
        output:
            cameras=f"{RESULTS}/capture/cameras.parquet",
            quality=f"{RESULTS}/capture/calibration_quality.parquet",
            picture=f"{RESULTS}/capture/rig.png",
        params:
            method=METHOD,
            facts=CALIBRATION["facts"],
            up=CALIBRATION["up"],
            seed=config["seed"],
        message:
            "calibrate the cameras of the rig"
        script:
            "../../scripts/capture/calibrate.py"

    rule export_calibration:
        input:
            cameras=rules.calibrate.output.cameras,
        output:
            toml=f"{RESULTS}/export/calibration.toml",
        message:
            "export the cameras as TOML"
        script:
            "../../scripts/capture/export_calibration.py"

    CALIBRATION_OUTPUTS = [*rules.calibrate.output, rules.export_calibration.output.toml]

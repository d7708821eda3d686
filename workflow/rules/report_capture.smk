# What the report says of the films: accuracy, rig, what markers cannot see, and a quality sheet for each record.

if VIRTUAL and FILMED:

    rule table_capture:
        input:
            scores=rules.capture_scores.output.scores,
            effect=rules.film_effect.output.effect,
        output:
            table=tabled("table-capture", "Capture"),
        params:
            width_px=config["studio"]["camera_width_px"],
            method=TRACKER,
            bin_s=WIDEST_BIN_S,
        message:
            "capture against truth, beside its goals"
        script:
            "../../scripts/report/table_capture.py"


if FILMED:

    rule fig_rig:
        input:
            picture=rules.calibrate.output.picture,
        output:
            **drawn("fig-rig", "Capture"),
        message:
            "the rig, as it was found"
        script:
            "../../scripts/report/picture.py"

    rule quality_sheet:
        input:
            template=TEMPLATE / "quality.html.jinja",
            parts=PARTS,
            calibration=rules.calibrate.output.quality,
            world=f"{RESULTS}/capture/{{record}}/markers_3d.parquet",
            spans=f"{RESULTS}/capture/{{record}}/marker_spans.parquet",
            moments=rules.worst_moments.output.table,
            pictures=rules.worst_moments.output.pictures,
            overlay=rules.overlay.output.video,
        output:
            sheet=f"{REPORTS}/capture/{{record}}.html",
        params:
            corrections=config["capture"]["corrections"],
        message:
            "quality sheet of {wildcards.record}"
        script:
            "../../scripts/report/quality_sheet.py"


if TAKES:

    rule table_observability:
        input:
            tables=expand(f"{RESULTS}/capture/{{record}}/observability.parquet", record=CAPTURED),
        output:
            table=tabled("table-observability", "Capture"),
        message:
            "which joint angles the markers tell"
        script:
            "../../scripts/report/table_observability.py"

# A quality sheet of each filmed record.

if FILMED:

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

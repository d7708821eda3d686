# From films and cameras to the markers of a record, in every view and in the world.

CAPTURE = config["capture"]
CAMERAS = [f"c{number}" for number in range(1, 6)]


def by_hand(kind):
    """The file of clicks or corrections of a record, where a person made one."""

    def path(wildcards):
        folder = CAPTURE.get(kind)
        given = f"{folder}/{wildcards.record}.csv"
        return given if folder and os.path.exists(given) else []

    return path


rule track:
    input:
        cameras=f"{RESULTS}/capture/cameras.parquet",
        films=expand(f"{RESULTS}/corpus/film/{{{{record}}}}/{{camera}}.mkv", camera=CAMERAS),
        clicks=by_hand("clicks"),
        corrections=by_hand("corrections"),
    output:
        views=f"{RESULTS}/capture/{{record}}/markers_2d.parquet",
        world=f"{RESULTS}/capture/{{record}}/markers_3d.parquet",
        spans=f"{RESULTS}/capture/{{record}}/marker_spans.parquet",
    log:
        f"{RESULTS}/logs/track/{{record}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/track/{{record}}.tsv"
    params:
        method=CAPTURE["track"]["method"],
        settings={key: CAPTURE["track"][key] for key in ("most_frames_apart", "longest_hidden_s")},
        corpus=config["corpus"]["name"],
        code=code("capture/track"),
    message:
        "markers of {wildcards.record} in every view and in the world"
    script:
        "../../scripts/capture/track.py"

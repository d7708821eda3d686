# From films to joint angles: markers in every view and in the world, then the body that carries them.

if FILMED:

    RANGES = {actor: f"range~{actor}" for actor in ACTORS}
    TAKE = "|".join([*RECORDS, *RANGES.values()])

    def by_hand(kind):
        """The file of clicks or corrections of a take, where a person made one."""

        def given(wildcards):
            folder = config["capture"][kind]
            path = Path(folder or "", f"{wildcards.take}.csv")
            return [str(path)] if folder and path.is_file() else []

        return given

    def range_of_motion(wildcards):
        """The markers of the range-of-motion take of the record's actor."""
        return f"{RESULTS}/capture/{RANGES[actor_of(wildcards.record)]}/markers_3d.parquet"

    rule track:
        input:
            cameras=rules.calibrate.output.cameras,
            calibration=rules.calibrate.input.take,
            films=expand(f"{RESULTS}/corpus/raw/{{{{take}}}}/{{view}}.mkv", view=VIEWS),
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
            take=TAKE,
        params:
            settings=config["capture"]["track"],
            corpus=config["corpus"]["name"],
            code=code("capture/track"),
        message:
            "markers of {wildcards.take} in every view and in the world"
        script:
            "../../scripts/capture/track.py"

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

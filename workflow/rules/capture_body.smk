# From markers in the world to joint angles, and out to other programs.


def range_of_motion(wildcards):
    """The markers of the range-of-motion take of the record's actor."""
    return f"{RESULTS}/capture/{actor_of(wildcards.record)}_range_of_motion/markers_3d.parquet"


rule skeleton:
    input:
        take=range_of_motion,
        markers=f"{RESULTS}/capture/{{record}}/markers_3d.parquet",
    output:
        motion=f"{RESULTS}/motion/{{record}}.parquet",
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
        "joint angles of {wildcards.record}"
    script:
        "../../scripts/capture/skeleton.py"


rule export:
    input:
        markers=f"{RESULTS}/capture/{{record}}/markers_3d.parquet",
        motion=f"{RESULTS}/motion/{{record}}.parquet",
    output:
        trc=f"{RESULTS}/export/{{record}}.trc",
        c3d=f"{RESULTS}/export/{{record}}.c3d",
        bvh=f"{RESULTS}/export/{{record}}.bvh",
    log:
        f"{RESULTS}/logs/export/{{record}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/export/{{record}}.tsv"
    params:
        corpus=config["corpus"]["name"],
        code=code("capture/export"),
    message:
        "{wildcards.record} as TRC, C3D and BVH"
    script:
        "../../scripts/capture/export.py"

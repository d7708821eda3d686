# Recordings of any origin are read into our tables; annotations are exported for correction and read back.

# What a record can bring, and where it is delivered to.
PLACES = {
    "motion": f"{RESULTS}/motion/{{record}}.parquet",
    "gestures": f"{RESULTS}/phrases/gesture/{{record}}.parquet",
    "head": f"{RESULTS}/head/{{record}}.parquet",
    "audio": f"{RESULTS}/corpus/audio/{{record}}.wav",
    "prosody": f"{RESULTS}/speech/{{record}}/prosody.parquet",
    "syllables": f"{RESULTS}/speech/{{record}}/syllables.parquet",
    "melody": f"{RESULTS}/speech/{{record}}/melody.parquet",
}
DELIVERED = {kind: path for kind, path in PLACES.items() if kind in BRINGS}


def given_record(wildcards):
    """Return the configured record without its annotations, so that new annotations do not change the record."""
    return {key: value for key, value in RECORDS[wildcards.record].items() if key != "annotations"}


def files_of(wildcards):
    """Return the input files of a record; films and markers are replaced by the angles computed from them."""
    name, record = wildcards.record, RECORDS[wildcards.record]
    if VIRTUAL and "audio" not in BRINGS:
        return {"features": f"{RESULTS}/corpus/raw/{record['actor']}"}
    files = {kind: record[kind] for kind in PLACES if record[kind]}
    if record["film_left"]:
        files["head"] = f"{RESULTS}/capture/head/{name}/pose.parquet"
    if name in TAKES:
        files["motion"] = f"{RESULTS}/capture/{name}/motion.parquet"
    if name in FILMED and "audio" in files and not VIRTUAL:
        files["offsets"] = f"{RESULTS}/capture/{name}/offsets.parquet"
    return files


def examples_of(wildcards):
    """Return the source of a record's annotated examples: a file, the studio's ground truth, or none (rules)."""
    given = RECORDS[wildcards.record]["annotations"]
    if given:
        return {"annotations": given}
    if VIRTUAL and config["phrases"]["gesture"]["first_examples"] == "annotations":
        return {"planted": f"{RESULTS}/corpus/truth/annotations.parquet"}
    return {}


def recording(wildcards):
    """Return what the annotations of a record have to agree with, besides its duration."""
    given = RECORDS[wildcards.record]
    return {
        "sound": given["audio"],
        "start_s": given["start_s"] or 0.0,
        "tolerance_s": config["corpus"]["length_tolerance_s"],
    }


rule record:
    input:
        unpack(files_of),
    output:
        **DELIVERED,
        record=f"{RESULTS}/corpus/records/{{record}}.parquet",
    params:
        record=given_record,
        motion=config["corpus"]["motion"],
        head=config["corpus"]["head"],
        length_tolerance_s=config["corpus"]["length_tolerance_s"],
        labels=config["phrases"]["gesture"]["labels"],
        frame_s=config["speech"]["frame_s"],
    message:
        "reading record {wildcards.record}"
    script:
        "../../scripts/corpus/record.py"


# Separate from the record itself, so that corrected annotations do not change its sound and motion.
rule examples:
    input:
        unpack(examples_of),
        record=f"{RESULTS}/corpus/records/{{record}}.parquet",
    output:
        annotations=f"{RESULTS}/corpus/annotations/{{record}}.parquet",
    params:
        labels=config["phrases"]["gesture"]["labels"],
        tier=config["corpus"]["annotations"]["tier"],
        recording=recording,
    message:
        "annotated examples of {wildcards.record}"
    script:
        "../../scripts/corpus/examples.py"


rule records:
    input:
        records=expand(f"{RESULTS}/corpus/records/{{record}}.parquet", record=RECORDS),
        annotations=f"{RESULTS}/corpus/annotations.parquet" if SYSTEMS else [],
    output:
        records=f"{RESULTS}/corpus/records.parquet",
    params:
        shortest_s=SHORTEST_S,
        shift_s=SYNTHESIS["shift_s"],
    message:
        "table of records"
    script:
        "../../scripts/corpus/records.py"


rule annotations:
    input:
        annotations=expand(f"{RESULTS}/corpus/annotations/{{record}}.parquet", record=RECORDS),
    output:
        annotations=f"{RESULTS}/corpus/annotations.parquet",
    message:
        "table of annotated examples"
    script:
        "../../scripts/corpus/annotations.py"


rule export_annotations:
    input:
        **{kind: path for kind, path in DELIVERED.items() if kind == "audio"},
        phrases=f"{RESULTS}/phrases/gesture/{{record}}.parquet",
    output:
        eaf=f"{RESULTS}/annotations/{{record}}.eaf",
        textgrid=f"{RESULTS}/annotations/{{record}}.TextGrid",
    params:
        labels=config["phrases"]["gesture"]["labels"],
    message:
        "exporting gesture phrases of {wildcards.record} to ELAN and Praat"
    script:
        "../../scripts/corpus/export_annotations.py"


# A head without a file or film of its own is that of the body.
if "head" not in BRINGS and "motion" in BRINGS:

    rule head:
        input:
            motions=expand(f"{RESULTS}/motion/{{record}}.parquet", record=RECORDS),
        output:
            heads=expand(f"{RESULTS}/head/{{record}}.parquet", record=RECORDS),
        message:
            f"angles of {len(RECORDS)} heads, from joint angles"
        script:
            "../../scripts/corpus/head.py"

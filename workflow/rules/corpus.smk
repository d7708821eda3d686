# Recordings of any making become our tables, and labelled examples go out for correction and come back.

DELIVERED = {
    **(
        {"motion": f"{RESULTS}/motion/{{record}}.parquet"}
        if "motion" in BRINGS
        else {"gestures": f"{RESULTS}/phrases/gesture/{{record}}.parquet"}
    ),
    **(
        {"audio": f"{RESULTS}/corpus/audio/{{record}}.wav"}
        if "audio" in BRINGS
        else {"prosody": f"{RESULTS}/speech/{{record}}/prosody.parquet"}
    ),
}


def given_record(wildcards):
    """The record as the configuration lists it, but for its annotations: new ones do not change it."""
    return {key: value for key, value in RECORDS[wildcards.record].items() if key != "annotations"}


def files_of(wildcards):
    """The files that a record is made of; films and markers have become joint angles."""
    name, record = wildcards.record, RECORDS[wildcards.record]
    files = {kind: record[kind] for kind in configuration.FILE_FIELDS if record[kind] and kind != "annotations"}
    if name in TAKES:
        files["motion"] = f"{RESULTS}/capture/{name}/motion.parquet"
    if name in FILMED and "audio" in files and not VIRTUAL:
        files["offsets"] = f"{RESULTS}/capture/{name}/offsets.parquet"
    return files


def examples_of(wildcards):
    """Where a record's labelled examples come from: a person's file, the studio's truth, or nowhere (rules)."""
    given = RECORDS[wildcards.record]["annotations"]
    if given:
        return {"annotations": given}
    if VIRTUAL and config["phrases"]["gesture"]["first_examples"] == "annotations":
        return {"planted": f"{RESULTS}/corpus/truth/annotations.parquet"}
    return {}


rule record:
    input:
        unpack(files_of),
    output:
        **DELIVERED,
        record=f"{RESULTS}/corpus/records/{{record}}.parquet",
    params:
        record=given_record,
        motion=config["corpus"]["motion"],
        length_tolerance_s=config["corpus"]["length_tolerance_s"],
        labels=config["phrases"]["gesture"]["labels"],
        frame_s=config["speech"]["frame_s"],
    message:
        "record {wildcards.record} enters"
    script:
        "../../scripts/corpus/record.py"


# Apart from the record itself, so that a corrected annotation leaves sound and motion as they are.
rule examples:
    input:
        unpack(examples_of),
        record=f"{RESULTS}/corpus/records/{{record}}.parquet",
    output:
        annotations=f"{RESULTS}/corpus/annotations/{{record}}.parquet",
    params:
        labels=config["phrases"]["gesture"]["labels"],
    message:
        "labelled examples of {wildcards.record}"
    script:
        "../../scripts/corpus/examples.py"


rule records:
    input:
        records=expand(f"{RESULTS}/corpus/records/{{record}}.parquet", record=RECORDS),
    output:
        records=f"{RESULTS}/corpus/records.parquet",
    message:
        "the record sheet"
    script:
        "../../scripts/corpus/records.py"


rule annotations:
    input:
        annotations=expand(f"{RESULTS}/corpus/annotations/{{record}}.parquet", record=RECORDS),
    output:
        annotations=f"{RESULTS}/corpus/annotations.parquet",
    message:
        "the labelled examples"
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
        "gesture phrases of {wildcards.record} for ELAN and Praat"
    script:
        "../../scripts/corpus/export_annotations.py"

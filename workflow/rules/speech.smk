# Prosody features, pitch, syllables and melody from sound. This step is skipped if the corpus supplies its own prosody tables.

if "audio" in BRINGS:

    rule prosody:
        input:
            audio=f"{RESULTS}/corpus/audio/{{record}}.wav",
        output:
            prosody=f"{RESULTS}/speech/{{record}}/prosody.parquet",
            statistics=f"{RESULTS}/speech/{{record}}/statistics.parquet",
            pitch=f"{RESULTS}/speech/{{record}}/pitch.parquet",
            pitch_statistics=f"{RESULTS}/speech/{{record}}/pitch_statistics.parquet",
        params:
            settings=config["speech"],
        message:
            "prosody features and pitch of {wildcards.record}"
        script:
            "../../scripts/speech/prosody.py"

    # Starting a process takes a hundred times as long as the syllables of a record, so one job makes all tables.
    rule syllables:
        input:
            audio=expand(f"{RESULTS}/corpus/audio/{{record}}.wav", record=RECORDS),
        output:
            syllables=expand(f"{RESULTS}/speech/{{record}}/syllables.parquet", record=RECORDS),
        params:
            records=list(RECORDS),
        message:
            f"syllables of {len(RECORDS)} records"
        script:
            "../../scripts/speech/syllables.py"

    # Pitch and intensity at 100 Hz, for systems that move the head.
    rule melody:
        input:
            audio=expand(f"{RESULTS}/corpus/audio/{{record}}.wav", record=RECORDS),
        output:
            melodies=expand(f"{RESULTS}/speech/{{record}}/melody.parquet", record=RECORDS),
        params:
            records=list(RECORDS),
            seed=config["seed"],
        message:
            f"pitch and intensity of {len(RECORDS)} records"
        script:
            "../../scripts/speech/melody.py"

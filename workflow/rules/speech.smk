# Prosody features from sound. This step is skipped if the corpus supplies its own prosody tables.

if "audio" in BRINGS:

    rule prosody:
        input:
            audio=f"{RESULTS}/corpus/audio/{{record}}.wav",
        output:
            prosody=f"{RESULTS}/speech/{{record}}/prosody.parquet",
            statistics=f"{RESULTS}/speech/{{record}}/statistics.parquet",
        params:
            settings=config["speech"],
        message:
            "prosody features of {wildcards.record}"
        script:
            "../../scripts/speech/prosody.py"

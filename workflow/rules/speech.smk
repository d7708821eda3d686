# Prosody features and pitch from sound. This step is skipped if the corpus supplies its own prosody tables.

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

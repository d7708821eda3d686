# From sound to prosody frames; a corpus that brings its own prosody tables has passed this room already.

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
            "prosody of {wildcards.record}"
        script:
            "../../scripts/speech/prosody.py"

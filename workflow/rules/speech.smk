# From sound to prosody frames; a corpus that brings its own prosody tables has passed this room already.

if "audio" in BRINGS:

    rule prosody:
        input:
            audio=f"{RESULTS}/corpus/audio/{{record}}.wav",
        output:
            prosody=f"{RESULTS}/speech/{{record}}/prosody.parquet",
            statistics=f"{RESULTS}/speech/{{record}}/statistics.parquet",
        log:
            f"{RESULTS}/logs/prosody/{{record}}.log",
        benchmark:
            f"{RESULTS}/benchmarks/prosody/{{record}}.tsv"
        params:
            settings=config["speech"],
            corpus=config["corpus"]["name"],
            code=code("speech/prosody"),
        message:
            "prosody of {wildcards.record}"
        script:
            "../../scripts/speech/prosody.py"

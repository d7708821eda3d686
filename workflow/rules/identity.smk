# Synchronisation and fusion of voice and lips, and error rates of identification. A run of this kind has no actors.

IDENTITY = config["identity"]
SESSIONS = ["1", "2", "3", "4"]
FEATURES = {"clips": f"{RESULTS}/identity/clips.parquet", "audio": VOICES_OF_CLIPS, "lips": LIPS_OF_CLIPS}

# Populations whose features are planted without sound and film, several in a job: one takes little longer than starting
# a process.
OTHERS = IDENTITY["populations"] if IDENTITY["population"] else {"number": 0}
BLOCK = 5
BLOCKS = range(-(-OTHERS["number"] // BLOCK))


rule delay:
    input:
        **FEATURES,
    output:
        delay=f"{RESULTS}/identity/delay.parquet",
        curve=f"{RESULTS}/identity/delay_curve.parquet",
    params:
        settings=IDENTITY["delay"],
        seed=config["seed"],
    message:
        "the delay between voice and lips"
    script:
        "../../scripts/identity/delay.py"


rule session:
    input:
        **FEATURES,
        delay=rules.delay.output.delay,
    output:
        trials=f"{RESULTS}/identity/sessions/{{session}}/trials.parquet",
        correlations=f"{RESULTS}/identity/sessions/{{session}}/canonical_correlations.parquet",
    wildcard_constraints:
        session="|".join(SESSIONS),
    params:
        word_models=IDENTITY["word_models"],
        thresholds=IDENTITY["thresholds"],
        controls=IDENTITY["controls"],
        regularisation=IDENTITY["regularisation"],
        seed=config["seed"],
    message:
        "train and test session {wildcards.session}"
    script:
        "../../scripts/identity/session.py"


rule shifts:
    input:
        **FEATURES,
    output:
        rates=f"{RESULTS}/identity/shift_rates.parquet",
    params:
        word_models=IDENTITY["word_models"],
        shifts_ms=IDENTITY["eer_shifts_ms"],
        bootstrap=config["evaluation"]["bootstrap"],
        seed=config["seed"],
    message:
        "error rates of early fusion at each shift"
    script:
        "../../scripts/identity/shifts.py"


rule equal_error_rates:
    input:
        clips=FEATURES["clips"],
        trials=expand(rules.session.output.trials, session=SESSIONS),
        correlations=expand(rules.session.output.correlations, session=SESSIONS),
    output:
        trials=f"{RESULTS}/identity/trials.parquet",
        correlations=f"{RESULTS}/identity/canonical_correlations.parquet",
        rates=f"{RESULTS}/identity/equal_error_rates.parquet",
        det=f"{RESULTS}/identity/det.parquet",
    params:
        bootstrap=config["evaluation"]["bootstrap"],
        seed=config["seed"],
    message:
        "equal error rates"
    script:
        "../../scripts/identity/equal_error_rates.py"


if OTHERS["number"]:

    rule populations:
        output:
            rates=f"{RESULTS}/identity/populations/{{block}}.parquet",
        wildcard_constraints:
            block=r"\d+",
        params:
            population=POPULATION,
            others=OTHERS,
            word_models=IDENTITY["word_models"],
            controls=IDENTITY["controls"],
            regularisation=IDENTITY["regularisation"],
            numbers=lambda wildcards: list(
                range(
                    1 + BLOCK * int(wildcards.block), 1 + min(BLOCK + BLOCK * int(wildcards.block), OTHERS["number"])
                )
            ),
            seed=config["seed"],
        message:
            "further populations, block {wildcards.block}"
        script:
            "../../scripts/identity/populations.py"

    rule gains:
        input:
            rates=expand(rules.populations.output.rates, block=BLOCKS),
        output:
            rates=f"{RESULTS}/identity/population_rates.parquet",
            gains=f"{RESULTS}/identity/gains.parquet",
        params:
            bootstrap=config["evaluation"]["bootstrap"],
            seed=config["seed"],
        message:
            f"gains over {OTHERS['number']} populations"
        script:
            "../../scripts/identity/gains.py"

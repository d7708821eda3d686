# Clips of speakers who say names, from a virtual population or from a sheet of the user's own films, and their features
# of voice and lips.

from cospeech.studio.population.settings import speaker_names

POPULATION = config["studio"]["population"]
SHEET = config["identity"]["sheet"]

# The clips of a speaker share a table of each kind; those of a sheet share one, too.
GROUPS = ["sheet"] if SHEET else speaker_names(POPULATION["speakers"])
VOICES_OF_CLIPS = expand(f"{RESULTS}/identity/audio/{{group}}.parquet", group=GROUPS)
LIPS_OF_CLIPS = expand(f"{RESULTS}/identity/lips/{{group}}.parquet", group=GROUPS)


if not SHEET and not POPULATION["sound"]:

    # A population without sound and film takes less time than starting a process for each speaker.
    rule population_features:
        output:
            clips=f"{RESULTS}/identity/clips.parquet",
            phones=f"{RESULTS}/corpus/truth/phones.parquet",
            audio=VOICES_OF_CLIPS,
            lips=LIPS_OF_CLIPS,
        params:
            population=POPULATION,
            seed=config["seed"],
        message:
            f"plant the features of {len(GROUPS)} speakers"
        script:
            "../../scripts/studio/population_features.py"

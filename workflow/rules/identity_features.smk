# Clips of speakers who say names, from a virtual population or from a sheet of the user's own films, and their features
# of voice and lips.

from cospeech.studio.population.settings import speaker_names

POPULATION = config["studio"]["population"]
SHEET = config["identity"]["sheet"]

# The clips of a speaker of the population share a table of each kind; those of a sheet share one, too.
GROUPS = ["sheet"] if SHEET else speaker_names(POPULATION["speakers"])
CLIPS = f"{RESULTS}/identity/clips.parquet"
# Of each group: a part of the table of clips.
PARTS_OF_CLIPS = [CLIPS] if SHEET else expand(f"{RESULTS}/identity/clips/{{group}}.parquet", group=GROUPS)
VOICES_OF_CLIPS = expand(f"{RESULTS}/identity/audio/{{group}}.parquet", group=GROUPS)
LIPS_OF_CLIPS = expand(f"{RESULTS}/identity/lips/{{group}}.parquet", group=GROUPS)

HAS_SOUND = bool(SHEET) or POPULATION["sound"]
HAS_FILM = bool(SHEET) or POPULATION["film"]


wildcard_constraints:
    group="|".join(GROUPS) if len(GROUPS) <= 100 else record_list.NAME,


if SHEET:
    from cospeech.corpus import clips as clips_of_sheet

    # The user's own films and sound files are inputs, so that a changed one is noticed.
    FILES_OF_SHEET = clips_of_sheet.files(SHEET)

    rule clips:
        input:
            sheet=SHEET,
            files=FILES_OF_SHEET,
        output:
            clips=CLIPS,
            mouths=f"{RESULTS}/identity/mouths.parquet",
        message:
            f"reading the sheet {SHEET}"
        script:
            "../../scripts/corpus/clips.py"

elif not HAS_SOUND:

    # A population without sound and film takes less time than starting a process for each speaker.
    rule population_features:
        output:
            clips=CLIPS,
            phones=f"{RESULTS}/corpus/truth/phones.parquet",
            audio=VOICES_OF_CLIPS,
            lips=LIPS_OF_CLIPS,
        params:
            population=POPULATION,
            seed=config["seed"],
        message:
            f"planting the features of {len(GROUPS)} speakers"
        script:
            "../../scripts/studio/population_features.py"

else:

    # The synthesiser keeps state, so that every speaker speaks in a process of their own.
    rule population_speaker:
        output:
            **({} if HAS_FILM else {"lips": f"{RESULTS}/identity/lips/{{group}}.parquet"}),
            clips=f"{RESULTS}/identity/clips/{{group}}.parquet",
            phones=f"{RESULTS}/corpus/truth/phones~{{group}}.parquet",
            folder=directory(f"{RESULTS}/corpus/raw/{{group}}"),
        params:
            population=POPULATION,
            seed=config["seed"],
        message:
            "recording the voice and the face of speaker {wildcards.group}"
        script:
            "../../scripts/studio/population_speaker.py"

    rule population_clips:
        input:
            clips=PARTS_OF_CLIPS,
            phones=expand(f"{RESULTS}/corpus/truth/phones~{{group}}.parquet", group=GROUPS),
        output:
            clips=CLIPS,
            phones=f"{RESULTS}/corpus/truth/phones.parquet",
        message:
            "table of clips"
        script:
            "../../scripts/studio/population_clips.py"


if HAS_SOUND:

    # One job for all: the coefficients of a speaker take less time than starting a process.
    rule mfcc:
        input:
            clips=PARTS_OF_CLIPS,
            recordings=FILES_OF_SHEET if SHEET else expand(f"{RESULTS}/corpus/raw/{{group}}", group=GROUPS),
        output:
            audio=VOICES_OF_CLIPS,
        message:
            "mel-frequency cepstral coefficients of all clips"
        script:
            "../../scripts/speech/mfcc.py"


if HAS_FILM:

    rule lips:
        input:
            clips=CLIPS if SHEET else f"{RESULTS}/identity/clips/{{group}}.parquet",
            recordings=FILES_OF_SHEET if SHEET else f"{RESULTS}/corpus/raw/{{group}}",
            mouths=f"{RESULTS}/identity/mouths.parquet" if SHEET else [],
        output:
            lips=f"{RESULTS}/identity/lips/{{group}}.parquet",
        message:
            "lips in the clips of {wildcards.group}"
        script:
            "../../scripts/identity/lips.py"

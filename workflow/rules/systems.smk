# Which systems run, what they are set to, and where their artifacts lie.

# ORIGINAL is not a system, but the record's own motion, labelled like that of the systems. It is the best that a system
# can reach where it is judged by its motion.
from cospeech.synthesis.declaration import ORIGINAL, shortest_shifted_s

SYNTHESIS = config["synthesis"]
ANIMATION = config["animation"]
SHARED_SETTINGS = {key: value for key, value in SYNTHESIS.items() if key != "systems"}


def own_settings(systems):
    """The settings that only these systems have: those of others must not rerun their jobs."""
    decoders = {CHOSEN.systems[system].decoder for system in systems}
    return {name: value for name, value in SYNTHESIS["systems"].items() if value and name in decoders}


def variant_of(system, setting=MAIN):
    """The variant of a system at one setting of the prosody clusters; 'main' where it does not listen to these."""
    listens = system != ORIGINAL and "prosody_labels" in CHOSEN.systems[system].needs
    return setting.variant if listens else "main"


def made_by(system, name, setting=MAIN):
    """The path of one artifact of a system."""
    return f"{RESULTS}/synthesis/{system}/{variant_of(system, setting)}/{{record}}/{name}"


def makers(systems, output):
    """The systems among these that make phrases, or motion."""
    return [system for system in systems if SYSTEMS[system].makes == output]


def shown_phrases(system):
    """The table of the phrases that pictures of a system's motion show."""
    return "phrases.parquet" if SYSTEMS[system].makes == "phrases" else "phrases_seen.parquet"


# The duration of the shortest record that can be driven by its own speech at another moment. Prosody frames of sound end
# where their windows end.
SHORTEST_S = None
if any(system.drive == "shifted" for system in CHOSEN.systems.values()):
    SHORTEST_S = shortest_shifted_s(SYNTHESIS["shift_s"], **config["evaluation"]["interior"])
    SHORTEST_S += config["speech"]["window_s"] - config["speech"]["frame_s"] if "audio" in BRINGS else 0.0

# Files that a job writes without declaring them, and the declared output of that job: each declared file adds a tenth
# to the planning time of a job.
WRITTEN_WITH = {}


def outputs_for(paths):
    """The declared outputs of the jobs that write these files, each once."""
    return list(dict.fromkeys(WRITTEN_WITH.get(path, path) for path in paths))


def reported_with(systems, output):
    """The tables of models and the reports that a job for each record writes besides a declared output."""
    return {
        made_by(system, f"{table}.parquet").format(record=record): output.format(record=record)
        for system in systems
        if CHOSEN.systems[system].drive == "own"
        for table in [
            *(CHOSEN.systems[system].tables if CHOSEN.systems[system].model == system else []),
            *CHOSEN.systems[system].reports,
        ]
        for record in RECORDS
    }


def model_tables(systems):
    """The tables of the models that these systems train, with their schemas, by system."""
    return {
        system: CHOSEN.systems[system].table_schemas
        for system in systems
        if CHOSEN.systems[system].role != "control" and CHOSEN.systems[system].model == system
    }

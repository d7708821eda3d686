# Which systems run, which of them are animated and shown, and where their artifacts lie.

# ORIGINAL is not a system, but the record's own motion, labelled like that of the systems. It is the best that a system
# can reach where it is judged by its motion.
from cospeech.synthesis.declaration import ORIGINAL, shortest_shifted_s

SYNTHESIS = config["synthesis"]
ANIMATION = config["animation"]
SHARED_SETTINGS = {key: value for key, value in SYNTHESIS.items() if key != "systems"}


def own_settings(systems):
    """The settings that only these systems have: those of others must not rerun their jobs."""
    decoders = {SYSTEMS[system].decoder for system in systems}
    return {name: value for name, value in SYNTHESIS["systems"].items() if value and name in decoders}


def variant_of(system, setting=MAIN):
    """The variant of a system at one setting of the prosody clusters; 'main' where it does not listen to these."""
    listens = system != ORIGINAL and "prosody_labels" in SYSTEMS[system].needs
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


# Systems of cospeech itself are so small that they share a process for each record. One that another package brings
# runs in a process of its own, with its controls under wrong speech, so that it cannot harm the others.
TOGETHER = [name for name in SYSTEMS if not CHOSEN.apart(name)]
APART = [name for name, system in SYSTEMS.items() if CHOSEN.apart(name) and system.drive == "own"]
SWEPT = [name for name in TOGETHER if SYSTEMS[name].swept and SYSTEMS[name].drive == "own"]

# The duration of the shortest record that can be driven by its own speech at another moment. Prosody frames of sound end
# where their windows end.
SHORTEST_S = None
if any(system.drive == "shifted" for system in SYSTEMS.values()):
    SHORTEST_S = shortest_shifted_s(SYNTHESIS["shift_s"], **config["evaluation"]["interior"])
    SHORTEST_S += config["speech"]["window_s"] - config["speech"]["frame_s"] if "audio" in BRINGS else 0.0

# The systems that are animated: those of the configuration, and all that make motion.
ANIMATED = [name for name in SYSTEMS if name in ANIMATION["systems"] or SYSTEMS[name].makes == "motion"]
ANIMATED_TOGETHER = [name for name in ANIMATED if not CHOSEN.apart(name)]
ANIMATED_APART = [name for name in ANIMATED if CHOSEN.apart(name)]

# Systems of cospeech itself, which cannot fail, followed by those of other packages.
RELIABLE_FIRST = [*ANIMATED_TOGETHER, *ANIMATED_APART]

# What a video shows next to the original: the systems that the configuration names, as far as they could be loaded,
# and a control that is not matched to one system, if there is one.
NAMED = ANIMATION["video"]["shown"]
NAMED = [name for name in ([NAMED] if isinstance(NAMED, str) else NAMED) if name in SYSTEMS]
SHOWN_TOGETHER = NAMED or RELIABLE_FIRST[:1]
CONTROLS = [name for name in RELIABLE_FIRST if SYSTEMS[name].role == "control"]
BASELINE = next((name for name in CONTROLS if SYSTEMS[name].drive == "own"), CONTROLS[0])
COMPARED = list(dict.fromkeys([*SHOWN_TOGETHER, BASELINE]))

# Where one picture is enough: the first that is shown and cannot fail, or else the first animated system that cannot.
SHOWN = [
    *(name for name in SHOWN_TOGETHER if name in ANIMATED_TOGETHER),
    *(name for name in ANIMATED_TOGETHER if SYSTEMS[name].role == "system"),
    *SHOWN_TOGETHER,
][0]

# The phrases of all systems that share a job. This table is declared as an output of the job, and so are the phrases of
# the systems that are animated; each declared file adds a tenth to the planning time of a job.
PLANNED = f"{RESULTS}/evaluation/planned/{{record}}.parquet"


def planned_apart(system):
    """The phrases of a system of another package and of its controls, with all draws of these."""
    return f"{RESULTS}/evaluation/planned/{system}/{{record}}.parquet"


# The same of what is seen in the motion that systems made themselves, in all draws, and how well this motion fits the
# recorded one.
SEEN_IN_MADE = f"{RESULTS}/evaluation/seen/{{record}}.parquet"
MADE_SCORES = f"{RESULTS}/evaluation/motion_scores/made/{{record}}.parquet"
UNIT_SCORES = f"{RESULTS}/evaluation/motion_scores/units/{{record}}.parquet"


def seen_apart(system):
    """The phrases seen in the motion that a system of another package and its controls made, with all draws of these."""
    return f"{RESULTS}/evaluation/seen/{system}/{{record}}.parquet"


def scores_apart(system):
    """The scores of the motion of a system of another package and its controls."""
    return f"{RESULTS}/evaluation/motion_scores/{system}/{{record}}.parquet"


WRITTEN_WITH = {
    made_by(system, "phrases.parquet").format(record=record): PLANNED.format(record=record)
    for system in makers(TOGETHER, "phrases")
    for record in RECORDS
} | {
    made_by(system, f"{table}.parquet").format(record=record): PLANNED.format(record=record)
    for system in TOGETHER
    if SYSTEMS[system].drive == "own"
    for table in [*(SYSTEMS[system].tables if SYSTEMS[system].model == system else []), *SYSTEMS[system].reports]
    for record in RECORDS
}


def outputs_for(paths):
    """The declared outputs of the jobs that write these files, each once."""
    return list(dict.fromkeys(WRITTEN_WITH.get(path, path) for path in paths))

# Which systems of phrases and motion share a process, and which of them are animated and shown.

# Systems of cospeech itself are so small that they share a process for each record. One that another package brings
# runs in a process of its own, with its controls under wrong speech, so that it cannot harm the others.
TOGETHER = [name for name in SYSTEMS if not CHOSEN.apart(name)]
APART = [name for name, system in SYSTEMS.items() if CHOSEN.apart(name) and system.drive == "own"]
SWEPT = [name for name in TOGETHER if SYSTEMS[name].swept and SYSTEMS[name].drive == "own"]

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

# The system whose head bodies show in videos that make none of their own. There is none if it does not run.
NODDING = ANIMATION["head"] if ANIMATION["head"] in HEADS and "motion" in BRINGS else None

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


WRITTEN_WITH |= {
    made_by(system, "phrases.parquet").format(record=record): PLANNED.format(record=record)
    for system in makers(TOGETHER, "phrases")
    for record in RECORDS
} | reported_with(TOGETHER, PLANNED)

# What the rules of several rooms ask: who a record belongs to, and what a script rests on.


def actor_of(record):
    return RECORDS[record]["actor"]


# Sorted out once: asked for every job, a walk over all records would make planning quadratic in them.
RECORDS_OF = {actor: [name for name in RECORDS if actor_of(name) == actor] for actor in ACTORS}


def records_of(actor):
    return RECORDS_OF[actor]


def others(record):
    """The records that a model may learn from when this one is held out."""
    return [name for name in records_of(actor_of(record)) if name != record]


# The first record of each actor, where one an actor is enough.
FIRST_RECORDS = [records_of(actor)[0] for actor in ACTORS]


def code(name):
    """The content hash of scripts/<name>.py and of every module of the package that it rests on."""
    return code_hash.code_hash(Path(workflow.basedir) / "scripts" / f"{name}.py")


def mistakes(since):
    """The one-line errors that jobs of this run left in their logs."""
    logs = sorted(Path(RESULTS, "logs").rglob("*.log"))
    recent = [log for log in logs if log.stat().st_mtime >= since]
    lines = [line for log in recent for line in log.read_text(encoding="utf-8").splitlines()]
    return list(dict.fromkeys(line.removeprefix("ERROR ") for line in lines if line.startswith("ERROR ")))

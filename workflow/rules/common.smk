# What rules of several rooms need: which actor a record belongs to, and what every rule with a script shares.


def actor_of(record):
    return RECORDS[record]["actor"]


# Sorted once: a search of all records for every job would make planning quadratic in their number.
RECORDS_OF = {actor: [] for actor in ACTORS}
for name in RECORDS:
    RECORDS_OF[actor_of(name)].append(name)


def records_of(actor):
    return RECORDS_OF[actor]


def others(record):
    """The records that a model may learn from when this one is held out."""
    return [name for name in records_of(actor_of(record)) if name != record]


# The first record of each actor, where one an actor is enough.
FIRST_RECORDS = [records_of(actor)[0] for actor in ACTORS]


def complete(scripted):
    """Give a rule with a script what all of these share: its log, its benchmark, the corpus and the hash of its code.

    Log and benchmark lie in a folder named after the rule, and are named after its wildcards.
    """
    script = Path(scripted.basedir.get_path_or_uri(secret_free=False), scripted.script).resolve()
    name = Path(scripted.name, *(f"{{{wildcard}}}" for wildcard in sorted(scripted.wildcard_names)))
    scripted.log_modifier = scripted.benchmark_modifier = workflow.modifier.path_modifier
    scripted.set_log(f"{RESULTS}/logs/{name}.log")
    scripted.benchmark = f"{RESULTS}/benchmarks/{name}.tsv"
    scripted.set_params(corpus=config["corpus"]["name"], code=code_hash.code_hash(script))


def mistakes(since):
    """The one-line errors that jobs of this run left in their logs."""
    logs = sorted(Path(RESULTS, "logs").rglob("*.log"))
    recent = [log for log in logs if log.stat().st_mtime >= since]
    lines = [line for log in recent for line in log.read_text(encoding="utf-8").splitlines()]
    return list(dict.fromkeys(line.removeprefix("ERROR ") for line in lines if line.startswith("ERROR ")))

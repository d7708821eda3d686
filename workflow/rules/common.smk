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
    if scripted.output:  # to Snakemake a benchmark is an output, and a rule with an output runs once
        scripted.benchmark = f"{RESULTS}/benchmarks/{name}.tsv"
    scripted.set_params(corpus=config["corpus"]["name"], code=code_hash.code_hash(script))


def mistakes(since):
    """The one-line errors that jobs of this run left in their logs."""
    logs = sorted(Path(RESULTS, "logs").rglob("*.log"))
    recent = [log for log in logs if log.stat().st_mtime >= since]
    lines = [line for log in recent for line in log.read_text(encoding="utf-8").splitlines()]
    return list(dict.fromkeys(line.removeprefix("ERROR ") for line in lines if line.startswith("ERROR ")))


# What wildcards of these names may stand for. Their constraints do not say so where there are many names.
VALUES = {
    "record": RECORDS,
    "fold": RECORDS,
    "actor": ACTORS,
    "system": CHOSEN.systems,
    "trained": [*RECORDS, *ACTORS],
}


def is_planned(receipt):
    """Whether the job that left a receipt belongs to this configuration."""
    if receipt.rule == receipts.END_OF_RUN:
        return True
    if not workflow.is_rule(receipt.rule):
        return False
    named = {name: value.removeprefix("fold~") for name, value in receipt.wildcards.items() if name in VALUES}
    writes = workflow.get_rule(receipt.rule).is_producer(receipt.output)
    return writes and all(value in VALUES[name] for name, value in named.items())


def left_over(wildcards):
    """The receipts of jobs that do not belong to this configuration."""
    return [receipt.path for receipt in receipts.load(RESULTS) if not is_planned(receipt)]


def promised(wildcards):
    """What the target `all` asks for. Jobs of which a file was deleted are repeated.

    By itself Snakemake would not look for files that no job reads, or that are not needed as what is made from them
    exists.
    """
    planned = [receipt for receipt in receipts.load(RESULTS) if is_planned(receipt)]
    workflow.dag.forcefiles.update(receipt.output for receipt in planned if receipts.missing(receipt))
    return PROMISED if RECORDS or IDENTIFIES or DIRECTIONS else CALIBRATION_OUTPUTS


def refuse_what_was_changed():
    """Stop before results are made from a file that something else than its job has written to."""
    planned = [receipt for receipt in receipts.load(RESULTS) if receipt.finished and is_planned(receipt)]
    changed = [path for receipt in planned for path in receipts.changed(receipt, thoroughly=False)]
    if changed:
        raise WorkflowError(
            f"cospeech: {', '.join(changed)}: changed since the run wrote it; delete it and run again"
        )


def write_manifest():
    """Write the manifest from the receipts of all jobs of this configuration."""
    from cospeech.workflow import manifest  # not above: this imports pandas
    from cospeech.workflow.job import settings_hash

    planned = [receipt for receipt in receipts.load(RESULTS) if is_planned(receipt)]
    if planned:
        manifest.write_table(RESULTS, planned, corpus=config["corpus"]["name"], config_hash=settings_hash(config))


def write_seconds():
    """Write the page that shows how long each rule took."""
    from cospeech.report import timings  # not above: it imports pandas

    receipt = receipts.place(RESULTS, receipts.END_OF_RUN, {})
    receipts.begin(receipt)
    written = timings.save(
        Path(RESULTS, "benchmarks"), Path(REPORTS), TEMPLATE / "seconds.html.jinja", config["report"]["title"]
    )
    receipts.save(receipt, receipts.END_OF_RUN, {}, "", written)

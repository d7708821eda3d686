"""cospeech: a record goes in as film and sound, passes one room after another as tables, and comes out as
scores, figures and moving bodies."""

import gc
import time
from collections import Counter
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.utils import min_version

from cospeech.kernels import code_hash
from cospeech.workflow import progress, receipts, run_lock, short_records, time_estimate
from cospeech.workflow import config as configuration
from cospeech.workflow import config_file, leftovers, paths, processes
from cospeech.workflow import records as record_list
from cospeech.workflow import sweep as settings
from cospeech.workflow import takes as capture_takes
from cospeech.errors import UserError
from cospeech.data.vocabulary import prosody_labels
from cospeech.synthesis.registry import registered

min_version("9.0")

# Everything that planning creates is needed to its end. Searching it for garbage takes a fifth of the time.
gc.disable()


# The embedded default; what --configfile names is laid over it.
configfile: Path(workflow.basedir) / "config/demo.yaml"


try:
    for name in workflow.overwrite_configfiles:
        config_file.check(Path(name))
    checked = configuration.in_order(configuration.normalised(config))
    configuration.check(checked)
    config.clear()
    config.update(checked)
    RESULTS = f"results/{config['run']}"
    REPORTS = f"reports/{config['run']}"
    VIRTUAL = config["corpus"]["source"] == "studio"
    IDENTIFIES = configuration.identifies(config)
    DIRECTIONS = configuration.gives_directions(config)
    run_lock.check_writable(Path())
    paths.plain(workflow.basedir, "the folder of cospeech")
    capture_takes.check_paths(config)
    RECORDS = {} if IDENTIFIES or DIRECTIONS else record_list.records(config, RESULTS)
    BRINGS = record_list.brings(RECORDS)
    configuration.check_labels(config, BRINGS)
    TAKES = capture_takes.takes(config, RECORDS, RESULTS)
    CHOSEN = registered(config["synthesis"]["systems"], VIRTUAL, record_list.offers(BRINGS))
    if RECORDS:  # without any, nothing is synthesised
        configuration.check_systems(config, CHOSEN.systems, CHOSEN.failed())
    TRANSPLANTS = record_list.transplants(config, RECORDS)
    OWN_TAKE = capture_takes.calibration_films(config)
except UserError as error:
    raise WorkflowError(f"cospeech: {paths.explain(error, workflow.overwrite_configfiles)}") from None

if workflow.is_main_process:
    for message in CHOSEN.messages() if RECORDS else [failure.message for failure in CHOSEN.failures]:
        progress.write_line(f"cospeech: {message}")

# The takes that come as films, one of each camera of the rig.
FILMED = [take for take, files in TAKES.items() if not capture_takes.is_marker_file(files[0])]
# The records whose joint angles come from markers or films.
CAPTURED = [record for record in RECORDS if record in TAKES]
FILMED_RECORDS = [record for record in CAPTURED if record in FILMED]
ALL_FILMED = VIRTUAL and FILMED_RECORDS == list(RECORDS)
VIEWS = list(capture_takes.STUDIO_VIEWS) if VIRTUAL and FILMED else []

ACTORS = list(dict.fromkeys(record["actor"] for record in RECORDS.values()))
MAIN = settings.main_setting(config)
SWEEP = settings.sweep_settings(config)
# Systems that plan gesture phrases or move the body, and those that move the head alone.
SYSTEMS = {name: system for name, system in CHOSEN.systems.items() if system.makes != "head"}
HEADS = {name: system for name, system in CHOSEN.systems.items() if system.makes == "head"}


def one_of(names):
    """A constraint to these names, so that another one is an unknown file; where there are many, to any name.

    Snakemake evaluates a constraint for every path, which takes long with a long list of names.
    """
    return "|".join(names) if len(names) <= 100 else record_list.NAME


wildcard_constraints:
    record=one_of(RECORDS),
    fold=one_of(RECORDS),
    actor=one_of(ACTORS),
    system="|".join(SYSTEMS) or "none",


include: "workflow/rules/common.smk"
include: "workflow/rules/calibration.smk"
include: "workflow/rules/exhibits.smk"


# Without records a run identifies speakers, is about route directions, or calibrates a rig, and nothing else.
MODELS, SWEEP_FIGURES, LIBRARIES = [], [], []

# The records whose heads were filmed, and the heads that are shown.
FILMED_HEADS = [record for record, given in RECORDS.items() if given["film_left"]]
HEADS_SHOWN, PORTRAYED, TRANSPLANTED_HEADS = [], [], []

if RECORDS:

    include: "workflow/rules/systems.smk"
    include: "workflow/rules/studio.smk"
    include: "workflow/rules/capture.smk"
    include: "workflow/rules/capture_head.smk"
    include: "workflow/rules/corpus.smk"
    include: "workflow/rules/speech.smk"

    # Where systems move nothing but heads, nobody looks for gesture phrases.
    if SYSTEMS:

        include: "workflow/rules/animated.smk"
        include: "workflow/rules/segmentation.smk"
        include: "workflow/rules/synthesis.smk"
        include: "workflow/rules/rendering.smk"
        include: "workflow/rules/models.smk"
        include: "workflow/rules/evaluation.smk"

    if HEADS:

        include: "workflow/rules/heads.smk"
    include: "workflow/rules/report.smk"
    include: "workflow/rules/report_capture.smk"


if IDENTIFIES:

    include: "workflow/rules/identity_features.smk"
    include: "workflow/rules/identity.smk"
    include: "workflow/rules/report_identity.smk"


if DIRECTIONS:

    include: "workflow/rules/directions.smk"


localrules:
    all,
    sweep,
    annotate,
    markers,
    calibration,
    quality,
    survey,
    libraries,
    models,
    verify,


rule all:
    default_target: True
    input:
        promised,


rule sweep:
    input:
        SWEEP_FIGURES,


rule annotate:
    input:
        expand(f"{RESULTS}/annotations/{{record}}.{{format}}", record=RECORDS, format=["eaf", "TextGrid"]),


rule markers:
    input:
        expand(
            f"{RESULTS}/export/{{record}}.{{format}}",
            record=[record for record in RECORDS if record in TAKES],
            format=["trc", "c3d", "bvh"],
        ),


rule libraries:
    input:
        LIBRARIES,


rule models:
    input:
        MODELS,


rule calibration:
    input:
        CALIBRATION_OUTPUTS,


rule quality:
    input:
        expand(f"{REPORTS}/capture/{{record}}.html", record=FILMED_RECORDS),


rule survey:
    input:
        expand(f"{RESULTS}/survey/{{record}}", record=RECORDS if "motion" in BRINGS else []),


rule verify:
    params:
        results=RESULTS,
        reports=REPORTS,
        left_over=left_over,
    message:
        "comparing every file of the run with the manifest"
    script:
        "scripts/verify.py"


for scripted in [declared for declared in workflow.rules if declared.script]:
    complete(scripted)


STARTED = time.time()
processes.prepare()


onstart:
    try:
        run_lock.hold(Path(RESULTS, ".lock"))
        run_lock.check_writable(Path(REPORTS))
    except UserError as error:
        raise WorkflowError(f"cospeech: {error}") from None
    planned = Counter(job.rule.name for job in workflow.dag.needrun_jobs())
    if planned.keys() != {"verify"}:
        leftovers.remove([Path(RESULTS), Path(REPORTS)])
        refuse_what_was_changed()
    processes.end_on_interrupt()
    gc.freeze()
    gc.enable()
    if not workflow.non_local_exec:
        # A limit of jobs a second guards a cluster's queue. Here it would wake Snakemake's scheduler every second, and
        # once more for each job that has ended.
        workflow.scheduler.job_rate_limiter = None
    if RECORDS and SHORTEST_S is not None and any(name.startswith(("systems", "heads")) for name in planned):
        for line in short_records.lines(config, RECORDS, SHORTEST_S):
            progress.write_line(f"cospeech: {line}")
    if VIRTUAL and RECORDS:
        progress.tell(time_estimate.line(planned, config, len(VIEWS), len(SWEEP), workflow.cores))


onsuccess:
    if RECORDS or IDENTIFIES or DIRECTIONS:
        write_seconds()
    write_manifest()
    progress.tell(progress.done(workflow.dag.targetjobs, f"{REPORTS}/index.html"))


onerror:
    leftovers.remove([Path(RESULTS), Path(REPORTS)])
    write_manifest()
    for line in mistakes(since=STARTED):
        progress.write_line(f"cospeech: {line}")

"""A system trained on an actor's records, as a folder that new speech can be given to."""

from pathlib import Path

from cospeech import __version__
from cospeech.motion import skeleton
from cospeech.synthesis.registry import installed
from cospeech.synthesis.session import Session
from cospeech.synthesis.training import Actor, fold
from cospeech.workflow import job, model_folder

with job.run(snakemake) as work:
    given, records = work.params, work.params["records"]
    motions = work.read_each(records, work.input.motions, "motion")
    gestures = work.read(work.input.gestures, "segments")
    clusters = work.read(work.input.clusters, "segments")
    training, _ = fold(
        Actor(given["actor"], given["order"], given["frame_s"], given["labels"], given["symbols"]),
        given["held_out"],
        gestures,
        clusters,
        work.read_each(records, work.input.prosody, "prosody"),
        motions,
        syllables=work.read_each(records, work.input.syllables, "syllables"),
        phases=work.read(given["phases"], "phases") if given["phases"] else None,
        subunits={section: work.read(path, "subunits") for section, path in given["subunits"].items()},
    )
    system = installed(work.wildcards.system)
    made = Session(training, given["shared"], given["own"]).tables(system)
    named = {name: (made[name], schema) for name, schema in system.table_schemas.items()}
    named |= {f"motion~{record}": (motion, "motion") for record, motion in motions.items()}
    named["gestures"] = (gestures[gestures["record"].isin(records)], "segments")
    named["gesture_model"] = (work.read(work.input.gesture_model, "hmm_model"), "hmm_model")
    clusters_model = Path(work.input.clusters).with_name("model.parquet")
    named["prosody_model"] = (work.read(str(clusters_model), "hmm_model"), "hmm_model")
    card = given["card"] | {
        "system": system.name,
        "variant": work.wildcards.variant,
        "actor": given["actor"],
        "held_out": given["held_out"],
        "records": records,
        "version": __version__,
        "motion_fps": skeleton.frame_rate(next(iter(motions.values()))),
    }
    model_folder.write(Path(work.output.folder), card, named, corpus=work.corpus, config_hash=work.config_hash)

"""What a system scores where the true joint angles of one actor take the place of those from the films."""

from cospeech.evaluation import scores
from cospeech.segmentation import gesture
from cospeech.synthesis.registry import installed
from cospeech.synthesis.session import Driving, Session
from cospeech.synthesis.training import Actor, fold
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, records, name = work.params, work.params["records"], work.wildcards.actor
    actor = Actor(name, records, given["frame_s"], given["settings"]["labels"], given["symbols"])
    motions = work.read_each(records, work.input.motion, "motion")
    actual, folds = gesture.leave_one_out(
        motions, work.read(work.input.annotations, "annotations"), given["settings"]
    )
    system, made = installed(given["system"]), {}
    for record, path in zip(records, work.input.prosody, strict=True):
        training, streams = fold(actor, record, folds[record], work.read(path, "segments"))
        driving = Driving(streams, record, actor.frame_s, given["seed"])
        [one] = Session(training, given["shared"], given["own"]).synthesise(system, driving)
        made[scores.Scored(system.name, given["variant"], record, "planned")] = one.phrases
    own = {record: actual[actual["record"] == record] for record in records}
    table = scores.table(made, own, dict.fromkeys(records, name), scores.Rules(**given["rules"]))
    work.write(table, work.output.scores, "record_scores")

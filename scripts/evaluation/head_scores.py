"""Scores of all heads: of systems that move the head alone, of those that move the body, and of shifted records."""

from cospeech.evaluation import head as comparison
from cospeech.evaluation import head_sessions
from cospeech.evaluation.sessions import Bootstrap
from cospeech.motion import head
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params
    originals = work.read_each(list(given["actors"]), work.input.heads, "head")
    found = [work.read(path, "head_scores") for path in work.input.scores]
    for (system, variant, record), path in zip(given["whole"], work.input.motions, strict=True):
        motion = work.read(path, "motion")
        if len(motion):  # not that of a control that leaves the record out
            named = {"system": system, "variant": variant, "actor": given["actors"][record], "record": record}
            found.append(head_sessions.scored(originals[record], head.of_body(motion)).assign(**named, draw=0))
    for record, actor in given["actors"].items():
        named = {"system": given["shifted"], "variant": "main", "actor": actor, "record": record}
        for draw, made in enumerate(comparison.shifted(originals[record], given["shift_s"])):
            found.append(head_sessions.scored(originals[record], made).assign(**named, draw=draw))
    work.write(found, work.output.scores, "head_scores")
    scores = work.read(work.output.scores, "head_scores")
    settings = Bootstrap(**given["bootstrap"], seed=given["seed"])
    work.write(
        head_sessions.table(scores, head_sessions.pairs(given["systems"]), settings),
        work.output.sessions,
        "head_sessions",
    )

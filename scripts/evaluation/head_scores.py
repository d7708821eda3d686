"""Scores of all heads: of systems that move the head alone, and of those that move the whole body."""

from cospeech.evaluation import head as scoring
from cospeech.motion import head
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params
    found = [work.read(path, "head_scores") for path in work.input.scores]
    originals = work.read_each(given["records"], work.input.heads, "head")
    for (system, variant, record), path in zip(given["whole"], work.input.motions, strict=True):
        motion = work.read(path, "motion")
        if len(motion):  # not that of a control that leaves the record out
            named = {"system": system, "variant": variant, "actor": given["actors"][record], "record": record}
            found.append(scoring.scores(originals[record], head.of_body(motion)).assign(**named, draw=0))
    work.write(found, work.output.scores, "head_scores")

"""Score keywords, accents and gestures in route directions."""

from cospeech.evaluation import directions
from cospeech.evaluation.directions import Settings
from cospeech.workflow import job

with job.run(snakemake) as work:
    scores = directions.scores(
        work.read(work.input.detections, "direction_detections"),
        work.read(work.input.events, "direction_events"),
        work.read(work.input.records, "direction_records"),
        work.params["keywords"],
        Settings(**work.params["bootstrap"]),
        work.params["seed"],
    )
    work.write(scores, work.output.scores, "direction_scores")

"""Animate the tested answer with most keywords by the keywords and accents that were found in its speech."""

from cospeech.markov.mixture_hmm import Training
from cospeech.markov.spotting import Segment
from cospeech.synthesis.directions import animation
from cospeech.workflow import job

with job.run(snakemake) as work:
    given, fps = work.params, work.params["fps"]
    records = work.read(work.input.records, "direction_records")
    events = work.read(work.input.events, "direction_events")
    found = work.read([work.input.keywords, work.input.accents], "direction_detections")
    movement = dict(iter(work.read(work.input.movement, "direction_movement").groupby("record", sort=False)))
    known = set(records.loc[records["portion"] != "test", "record"])
    gestures = [
        Segment(one.record, round(one.start_s * fps), round(one.end_s * fps), one.label)
        for one in events[(events["tier"] == "hand") & events["record"].isin(known)].itertuples()
    ]
    training = Training(**given["training"])
    models = animation.hand_models(movement, gestures, given["states"], training, work.params["seed"])
    keywords = found[
        (found["task"] == "keywords") & (found["portion"] == "test") & (found["setting"] == given["gaussians"])
    ]
    accents = found[
        (found["task"] == "accents") & (found["label"] == "accent") & (found["method"] == given["features"])
    ]
    accents = accents[accents["setting"] == accents["setting"].max()]
    record = str(keywords["record"].value_counts(sort=True).index[0])
    duration_s = float(records.set_index("record").at[record, "duration_s"])
    spoken = [
        [
            animation.Event(*one)
            for one in rows.loc[rows["record"] == record, ["start_s", "end_s", "label"]].itertuples(
                index=False, name=None
            )
        ]
        for rows in (keywords, accents)
    ]
    table = animation.animate(record, duration_s, *spoken, models, fps)
    work.write(table, work.output.animation, "direction_animation")

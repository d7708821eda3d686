"""Measure the lips in the clips of a group; a clip whose film cannot be used is reported and left out."""

from cospeech.errors import UserError
from cospeech.identity.lips import features
from cospeech.workflow import job

with job.run(snakemake) as work:
    clips, tables = work.read(work.input.clips, "clips"), []
    mouths = work.read(work.input.mouths, "mouths") if work.input.mouths else None
    stated = {} if mouths is None else {one.clip: (one.x_px, one.y_px) for one in mouths.itertuples()}
    for clip in work.followed(list(clips.itertuples()), "clips"):
        try:
            tables.append(features.measure(clip.clip, clip.film, clip.fps, stated.get(clip.clip)))
        except UserError as error:
            work.warn(f"clip {clip.clip} is left out: {error}")
    if not tables:
        raise UserError(f"{work.input.clips}: no clip has a film that can be used; the lines above say why")
    work.write(tables, work.output.lips, "lips")

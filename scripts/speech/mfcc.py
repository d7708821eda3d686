"""Compute the coefficients of the sound of all clips; a clip whose sound cannot be used is reported and left out."""

from cospeech.errors import UserError
from cospeech.formats import audio
from cospeech.speech import mfcc
from cospeech.workflow import job

with job.run(snakemake) as work:
    for group, path in zip(work.input.clips, work.output.audio, strict=True):
        tables = []
        for clip in work.read(group, "clips").itertuples():
            try:
                sound = audio.read(clip.sound)
                tables.append(mfcc.table(clip.clip, mfcc.coefficients(sound.samples, audio.sound.RATE_HZ)))
            except UserError as error:
                work.warn(f"clip {clip.clip} is left out: {error}")
        if not tables:
            raise UserError(f"{group}: no clip has sound that can be used; the lines above say why")
        work.write(tables, path, "mfcc")

"""Measure pitch and intensity of all records at 100 Hz, as the head follows them."""

import soundfile

from cospeech.speech import melody, pitch
from cospeech.workflow import job

with job.run(snakemake) as work:
    for record, audio, path in zip(work.params["records"], work.input.audio, work.output.melodies, strict=True):
        samples, rate_hz = soundfile.read(audio)
        table = melody.table(
            record, pitch.track(samples, rate_hz).f0_hz, melody.intensity(samples, rate_hz), work.params["seed"]
        )
        work.say(f"{record}: utterances fill {table['active'].mean():.0%} of {len(table) * melody.STEP_S:.1f} s")
        work.write(table, path, "melody")

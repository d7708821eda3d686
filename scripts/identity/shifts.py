"""Error rates of early fusion with the lips shifted (Sargin 2006, fig. 2.1b)."""

from cospeech.identity import features, shifts
from cospeech.identity.classifiers import Settings
from cospeech.identity.verification import Bootstrap
from cospeech.workflow import job

with job.run(snakemake) as work:
    clips = work.read(work.input.clips, "clips")
    given = features.of_tables(clips, work.read(work.input.audio, "mfcc"), work.read(work.input.lips, "lips"))
    rates = shifts.equal_error_rates(
        given,
        work.params["shifts_ms"],
        Settings(**work.params["word_models"]),
        Bootstrap(**work.params["bootstrap"], seed=work.params["seed"]),
    )
    work.write(rates, work.output.rates, "shift_rates")

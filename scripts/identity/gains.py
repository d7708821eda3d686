"""What fusion by canonical correlation analysis gains, over other strategies and over its controls."""

from cospeech.identity import populations
from cospeech.identity.verification import Bootstrap
from cospeech.workflow import job

with job.run(snakemake) as work:
    rates = work.read(work.input.rates, "population_rates")
    settings = Bootstrap(**work.params["bootstrap"], seed=work.params["seed"])
    work.write(rates, work.output.rates, "population_rates")
    work.write(populations.gains(rates, settings), work.output.gains, "gains")

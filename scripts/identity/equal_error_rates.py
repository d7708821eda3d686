"""Equal error rates of all strategies, with intervals, and the operating points of some."""

from cospeech.identity import verification
from cospeech.workflow import job

with job.run(snakemake) as work:
    clips = work.read(work.input.clips, "clips")
    trials = work.read(work.input.trials, "trials")
    settings = verification.Bootstrap(**work.params["bootstrap"], seed=work.params["seed"])
    rates = verification.equal_error_rates(trials, clips, settings)
    for line in verification.lacking(clips):
        work.warn(line)
    work.write(trials, work.output.trials, "trials")
    work.write(work.read(work.input.correlations, "canonical_correlations"), work.output.correlations,
               "canonical_correlations")  # fmt: skip
    work.write(rates, work.output.rates, "equal_error_rates")
    work.write(verification.det(trials, verification.shown(rates)), work.output.det, "det")

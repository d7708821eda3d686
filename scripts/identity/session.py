"""One session: all strategies and controls, trained on one half of the clips and tested on the other."""

from cospeech.identity import canonical, features, sessions, strategies
from cospeech.identity.classifiers import Settings
from cospeech.workflow import job

with job.run(snakemake) as work:
    clips = work.read(work.input.clips, "clips")
    given = features.of_tables(clips, work.read(work.input.audio, "mfcc"), work.read(work.input.lips, "lips"))
    given = features.shifted(given, int(work.read(work.input.delay, "delay")["shift"].iloc[0]))
    session = sessions.named(given.clips, work.wildcards.session)
    settings, regularisation = Settings(**work.params["word_models"]), work.params["regularisation"]
    found, correlations = strategies.of_session(
        given,
        session,
        settings,
        work.params["thresholds"],
        work.params["controls"],
        regularisation,
        work.params["seed"],
    )
    wanted = strategies.dimensions(correlations, work.params["thresholds"])
    found += strategies.ceiling(given, session, settings, wanted, regularisation)
    work.write([strategies.trials(given, session, one) for one in found], work.output.trials, "trials")
    table = canonical.correlation_table(session.name, correlations)
    work.write(table, work.output.correlations, "canonical_correlations")

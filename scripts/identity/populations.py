"""Error rates in further populations, whose features of voice and lips are planted."""

from cospeech.identity import features, populations
from cospeech.identity.classifiers import Settings
from cospeech.speech import mfcc
from cospeech.studio.population import planting, speakers
from cospeech.studio.population.settings import Settings as Population
from cospeech.workflow import job

with job.run(snakemake) as work:
    others = work.params["others"]
    planted = Population(
        **work.params["population"] | {"speakers": others["speakers"], "film": False, "sound": False}
    )
    rates = []
    for number in work.followed(work.params["numbers"], "populations"):
        seed = populations.seed(work.params["seed"], number)
        everyone = speakers.population(planted, seed)
        clips, audio, lips = [], [], []
        for speaker in everyone:
            said = speakers.utterances(everyone, speaker, planted, seed)
            articulated = {one: planting.utter(one, everyone, planted, seed) for one in said}
            clips.append(speakers.clips_table(articulated, None, planted))
            audio += [
                mfcc.table(one.clip, mfcc.with_derivatives(planting.cepstra(one, how, planted, seed)))
                for one, how in articulated.items()
            ]
            lips += [
                planting.lips_table(one.clip, planting.lips(one, how, planted, seed), planted.fps)
                for one, how in articulated.items()
            ]
        rates.append(
            populations.rates(
                number,
                features.of_lists(clips, audio, lips),
                round(planted.delay_s * features.RATE_HZ),
                Settings(**work.params["word_models"]),
                others["threshold"],
                work.params["controls"],
                work.params["regularisation"],
                seed,
            )
        )
    work.write(rates, work.output.rates, "population_rates")

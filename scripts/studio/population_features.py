"""Plant the features of voice and lips of a whole population, without sound and film."""

from cospeech.speech import mfcc
from cospeech.studio.population import planting, speakers
from cospeech.studio.population.settings import Settings
from cospeech.workflow import job

with job.run(snakemake) as work:
    settings, seed = Settings(**work.params["population"]), work.params["seed"]
    everyone = speakers.population(settings, seed)
    clips, phones = [], []
    for speaker, audio, lips in zip(everyone, work.output.audio, work.output.lips, strict=True):
        said = speakers.utterances(everyone, speaker, settings, seed)
        articulated = {one: planting.utter(one, everyone, settings, seed) for one in said}
        clips.append(speakers.clips_table(articulated, None, settings))
        phones += [planting.phones_table(one.clip, how.heard) for one, how in articulated.items()]
        work.write(
            [
                mfcc.table(one.clip, mfcc.with_derivatives(planting.cepstra(one, how, settings, seed)))
                for one, how in articulated.items()
            ],
            audio,
            "mfcc",
        )
        work.write(
            [
                planting.lips_table(one.clip, planting.lips(one, how, settings, seed), settings.fps)
                for one, how in articulated.items()
            ],
            lips,
            "lips",
        )
    work.write(clips, work.output.clips, "clips")
    work.write(phones, work.output.phones, "phones")

"""Record one speaker of a population: the sound of every clip, and its film or planted lip features."""

import soundfile

from cospeech.data import tables
from cospeech.studio import film as camera
from cospeech.studio.population import face, film, planting, speakers, voice
from cospeech.studio.population.settings import Settings
from cospeech.workflow import job

with job.run(snakemake) as work:
    settings, seed = Settings(**work.params["population"]), work.params["seed"]
    everyone = speakers.population(settings, seed)
    speaker = next(one for one in everyone if one.name == work.wildcards.group)
    own_voice = voice.voice_of(speaker, settings.own_voice, seed)
    own_face = face.face(speaker, settings.own_lips, seed) if settings.film else None
    said = {}
    for one in speakers.utterances(everyone, speaker, settings, seed):
        usual, heard = voice.speak(one, own_voice, seed)
        said[one] = how = speakers.articulate(one, heard, everyone, settings, seed)
        with tables.replacing(f"{work.output.folder}/{one.clip}.wav") as path:
            soundfile.write(path, voice.articulated(usual, how, one, seed), voice.RATE_HZ, subtype="PCM_16")
        if own_face:
            with tables.replacing(f"{work.output.folder}/{one.clip}.mkv") as path:
                camera.encode(path, film.frames(own_face, one, how, settings.fps, seed), settings.fps)
    work.write(speakers.clips_table(said, work.output.folder, settings), work.output.clips, "clips")
    work.write(
        [planting.phones_table(one.clip, how.heard) for one, how in said.items()], work.output.phones, "phones"
    )
    if not settings.film:
        planted = [
            planting.lips_table(one.clip, planting.lips(one, how, settings, seed), settings.fps)
            for one, how in said.items()
        ]
        work.write(planted, work.output.lips, "lips")

"""Record the answers of one voice: their sound, what is said and accented, and the movements of head and hands."""

import pandas as pd
import soundfile

from cospeech.data import tables
from cospeech.data.rng import random_source
from cospeech.studio.directions import gestures, sentences, voice
from cospeech.studio.directions.settings import Settings
from cospeech.workflow import job

with job.run(snakemake) as work:
    settings, seed, own = Settings(**work.params["directions"]), work.params["seed"], work.wildcards.voice
    records, events, movements, start_s = [], [], [], 0.0
    for number in range(settings.answers):
        record = f"{own}_{number + 1}"
        text = sentences.answer(random_source(seed, "directions", "sentences", record))
        spoken = voice.speak(record, own, text, settings, seed)
        with tables.replacing(f"{work.output.folder}/{record}.wav") as path:
            soundfile.write(path, spoken.samples, voice.RATE_HZ, subtype="PCM_16")
        duration_s = len(spoken.samples) / voice.RATE_HZ
        performed = gestures.perform(record, spoken, duration_s, settings, seed)
        tiers = {"word": spoken.words, "syllable": spoken.syllables, "head": performed.head, "hand": performed.hand}
        events.append(gestures.event_table(record, tiers))
        movements.append(gestures.movement_table(record, performed.movement))
        records.append(
            {
                "record": record,
                "voice": own,
                "sound": f"{work.output.folder}/{record}.wav",
                "start_s": start_s,
                "duration_s": duration_s,
                "portion": settings.portion(number),
                "text": " ".join(text),
            }
        )
        start_s += duration_s
    work.write(pd.DataFrame(records), work.output.records, "direction_records")
    work.write(events, work.output.events, "direction_events")
    work.write(movements, work.output.movement, "direction_movement")

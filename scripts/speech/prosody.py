"""Compute the prosody features of one record, and the statistics used to normalise them."""

import soundfile

from cospeech.speech import prosody
from cospeech.workflow import job

with job.run(snakemake) as work:
    record, settings = work.wildcards.record, dict(work.params["settings"])
    voiced_gain = settings.pop("voiced_gain")
    samples, rate_hz = soundfile.read(work.input.audio)
    frames = prosody.measure(samples, rate_hz, **settings)
    statistics = prosody.statistics(record, frames, voiced_gain)
    work.say(f"{record}: {statistics['n_voiced'].iloc[0]} of {len(frames.gain)} frames are voiced")
    work.write(statistics, work.output.statistics, "prosody_statistics")
    work.write(prosody.features(frames, statistics, settings["frame_s"]), work.output.prosody, "prosody")

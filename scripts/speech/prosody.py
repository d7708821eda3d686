"""Compute the prosody features of one record, the statistics used to normalise them, and its pitch track."""

import soundfile

from cospeech.speech import pitch, prosody
from cospeech.workflow import job

with job.run(snakemake) as work:
    record, settings = work.wildcards.record, dict(work.params["settings"])
    voiced_gain = settings.pop("voiced_gain")
    samples, rate_hz = soundfile.read(work.input.audio)
    frames = prosody.measure(samples, rate_hz, **settings)
    statistics = prosody.statistics(record, frames, voiced_gain)
    track = pitch.track(samples, rate_hz)
    speaker = pitch.statistics(record, track)
    work.say(
        f"{record}: mean pitch {speaker['f0_mean_hz'].iloc[0]:.0f} Hz; of {len(track.f0_hz)} pitch frames "
        f"{speaker['n_voiced'].iloc[0]} are voiced, of {len(frames.gain)} prosody frames "
        f"{statistics['n_voiced'].iloc[0]} by their pitch gain"
    )
    work.write(statistics, work.output.statistics, "prosody_statistics")
    work.write(prosody.features(frames, statistics, settings["frame_s"]), work.output.prosody, "prosody")
    work.write(speaker, work.output.pitch_statistics, "pitch_statistics")
    work.write(pitch.table(track), work.output.pitch, "pitch")

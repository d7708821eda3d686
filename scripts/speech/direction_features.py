"""Cepstral coefficients of all answers, and their pitch, intensity and formants."""

import soundfile

from cospeech.speech import accents, mfcc
from cospeech.workflow import job

with job.run(snakemake) as work:
    records = work.read(work.input.records, "direction_records")
    coefficients, features = [], []
    for record, sound in zip(records["record"], records["sound"], strict=True):
        samples, rate_hz = soundfile.read(sound)
        coefficients.append(mfcc.table(record, mfcc.coefficients(samples, rate_hz)))
        features.append(accents.table(record, samples, rate_hz, work.params["seed"]))
    work.write(coefficients, work.output.mfcc, "mfcc")
    work.write(features, work.output.accents, "accent_features")

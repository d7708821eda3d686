"""The delay between the voices and lips of all clips (Sargin 2006, 2.2)."""

from cospeech.identity import delay, features
from cospeech.workflow import job

with job.run(snakemake) as work:
    clips = work.read(work.input.clips, "clips")
    given = features.of_tables(clips, work.read(work.input.audio, "mfcc"), work.read(work.input.lips, "lips"))
    found = delay.find(given, delay.Settings(**work.params["settings"]), work.params["seed"])
    if found.doubt:
        work.warn(f"the delay between voice and lips cannot be told: {found.doubt}; the lips are not shifted")
    work.write(delay.table(found, clips), work.output.delay, "delay")
    work.write(delay.curve_table(found), work.output.curve, "delay_curve")

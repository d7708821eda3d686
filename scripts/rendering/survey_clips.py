"""Cut the motion of one record, in each of its versions, into clips for perception studies, with sound."""

import tempfile
from pathlib import Path

from cospeech.formats import sound
from cospeech.motion import skeleton
from cospeech.rendering import survey_clips, video
from cospeech.workflow import job

with job.run(snakemake) as work:
    record, settings = work.wildcards.record, work.params["settings"] | {"longest_s": None}
    phrases = work.read(work.input.phrases, "segments")
    motions = [work.read(path, "motion") for path in work.input.motions]
    made = {name: motion for name, motion in zip(work.params["versions"], motions, strict=True) if len(motion)}
    duration_s = len(motions[0]) / skeleton.frame_rate(motions[0])
    found = survey_clips.spans(phrases["start_s"].to_numpy(dtype=float), duration_s)
    folder = Path(work.output.folder)
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        for number, span in enumerate(found):
            spoken = None
            if work.input.audio:
                spoken = Path(temporary) / f"{number}.wav"
                sound.write(sound.read(work.input.audio, *span).samples, spoken)
            for version, motion in made.items():
                panel = survey_clips.cut(motion, phrases, span)
                video.write_video(folder / f"{number}~{version}.mp4", [panel], "", sound=spoken, **settings)
    table = survey_clips.table(record, found, list(made))
    work.write(table, folder / "clips.parquet", "survey_clips")
    work.say(f"{len(found)} clips of {', '.join(made)}")

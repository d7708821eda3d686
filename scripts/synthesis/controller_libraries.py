"""Controllers with other motion libraries: training times of their control layers, and frames of their motion."""

from pathlib import Path

import pandas as pd

from cospeech import api
from cospeech.motion import skeleton
from cospeech.synthesis.controller import report
from cospeech.synthesis.interface import Speech
from cospeech.workflow import job

with job.run(snakemake) as work:
    model = api.load_model(work.input.model).trained.model
    frame_s, motion = work.params["frame_s"], work.read(work.input.motion, "motion")
    fps = skeleton.frame_rate(motion)
    speech = Speech(
        work.params["record"],
        frame_s,
        int(len(motion) / fps / frame_s),
        syllables=work.read(work.input.syllables, "syllables"),
        motion_fps=fps,
        n_motion_frames=len(motion),
    )
    rows, strips = [], []
    for folder in map(Path, work.followed(work.input.libraries, "libraries")):
        found = api.motion_library(folder)
        layer, training_s = report.trained_on(model, found.segments)
        rows.append(
            {
                "library": folder.name,
                "library_s": sum(len(poses.root_m) for poses in found.folder.recordings.values()) / found.folder.fps,
                "segments": len(layer.kinematics),
                "hands": len(found.folder.hands),
                "training_s": training_s,
            }
        )
        strips.append(report.strip(model._replace(control=layer), speech, work.params["times_s"]))
        strips[-1].insert(0, "library", folder.name)
    work.write(pd.DataFrame(rows), work.output.table, "controller_libraries")
    work.write(pd.concat(strips, ignore_index=True), work.output.strips, "controller_strips")

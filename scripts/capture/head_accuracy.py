"""Capture a virtual head whose motion is known, over image size, contrast and noise."""

import numpy as np

from cospeech.capture.head import accuracy, optics, track
from cospeech.errors import UserError
from cospeech.studio import face, stereo
from cospeech.workflow import job

with job.run(snakemake) as work:
    given = work.params
    planted = accuracy.trial(given["n_frames"], stereo.FPS)
    acting = face.Acting(planted.angles_deg, face.pivoted(planted.angles_deg), planted.blink, planted.mouth)
    found, films = [], {}
    for case in accuracy.cases():
        cameras, condition = stereo.cameras(case.width_px), (case.width_px, case.contrast, case.noise)
        if condition not in films:
            looks = face.appearance(given["person"], given["seed"], case.contrast)
            films = {condition: face.render(acting, looks, cameras, case.noise, given["seed"])}
        own = optics.rectified(cameras)[0] if case.stereo else optics.single(cameras[0])
        views = zip(*films[condition][: 2 if case.stereo else 1], strict=True)
        where = f"virtual head, {case.width_px} pixels, contrast {case.contrast:g}, noise {case.noise:g}"
        try:
            poses = track.track_images(views, own, given["settings"] | case.settings, stereo.FPS, where).table
        except UserError as error:
            work.say(str(error))
            poses = track.lost(given["n_frames"], stereo.FPS)
        found.append(accuracy.rows(case, planted.angles_deg, poses))
        mean = np.nanmean(found[-1]["mean_deg"]) if found[-1]["mean_deg"].notna().any() else np.nan
        work.say(
            f"{where}, {case.flow.value}, {'stereo' if case.stereo else 'one camera'}: {mean:.2f} degrees on average"
        )
    work.write(found, work.output.accuracy, "head_accuracy")

"""Time the features of voice and lips from films on one core: python bench/lips.py

Three speakers of the virtual population say their names in films of 320 x 240 pixels at 15 frames per second. The
table shows the seconds that each step takes per second of film, and the time and the error of the alignment per frame
in the lip region, whose true motion is known.
"""

from __future__ import annotations

import tempfile
import time
from collections import Counter
from pathlib import Path

import cv2
import numpy as np

from cospeech.identity.lips import alignment, features, mouth
from cospeech.speech import mfcc
from cospeech.studio import film as camera
from cospeech.studio.population import drawing, face, film, planting, speakers, voice
from cospeech.studio.population.settings import Settings

SEED = 2006
SETTINGS = Settings(3, 6, 2, 0.7, 1.0, 1.0, 40.0, 2, 15.0, True, True)


def true_error(own: face.Face, one: speakers.Utterance, how: speakers.Articulation) -> tuple[list[float], float]:
    """Return the error of the alignment in each frame in pixels, and the seconds that it took per frame."""
    frames = [planes[0].copy() for planes in film.frames(own, one, how, SETTINGS.fps, SEED)]
    times_s = (np.arange(len(frames)) + 0.5) / SETTINGS.fps
    poses = [film.pose(head) for head in film.motion(one, times_s, SEED)]
    found = mouth.find(frames[0], one.clip)
    places = features.region_grid(found)[::8, ::8].reshape(-1, 2)
    points = np.array(
        [drawing.face_point(*(place - poses[0][6:8]).astype(np.float32), poses[0]) for place in places], dtype=float
    )
    first, last, errors, took_s = alignment.reference(frames[0], found), alignment.STILL, [], 0.0
    for frame, pose in zip(frames[1:], poses[1:], strict=True):
        started = time.process_time()
        last = alignment.align(first, frame, last)
        took_s += time.process_time() - started
        depth = drawing.DEPTH * (1 - (points[:, 0] / face.HALF_WIDTH) ** 2 - (points[:, 1] / face.HALF_HEIGHT) ** 2)
        truth = (
            points @ np.linalg.inv(pose[:4].reshape(2, 2).astype(float)).T + depth[:, None] * pose[4:6] + pose[6:8]
        )
        away = alignment.moved(first, last, places) - truth
        errors.append(float(np.sqrt((away**2).sum(axis=1).mean())))
    return errors, took_s / len(errors)


def main() -> None:
    """Print the times, and the errors of the alignment."""
    cv2.setNumThreads(1)
    everyone = speakers.population(SETTINGS, SEED)
    seconds: Counter[str] = Counter()
    errors: list[float] = []
    per_frame_s: list[float] = []
    film_s = 0.0
    with tempfile.TemporaryDirectory() as folder:
        for speaker in everyone:
            own, own_voice = face.face(speaker, 1.0, SEED), voice.voice_of(speaker, 1.0, SEED)
            for one in speakers.utterances(everyone, speaker, SETTINGS, SEED):
                path = Path(folder, f"{one.clip}.mkv")
                started = time.process_time()
                usual, heard = voice.speak(one, own_voice, SEED)
                how = speakers.articulate(one, heard, everyone, SETTINGS, SEED)
                samples = voice.articulated(usual, how, one, SEED)
                spoken = time.process_time()
                camera.encode(path, film.frames(own, one, how, SETTINGS.fps, SEED), SETTINGS.fps)
                filmed = time.process_time()
                features.measure(one.clip, path, SETTINGS.fps)
                measured = time.process_time()
                mfcc.coefficients(samples, voice.RATE_HZ)
                done = time.process_time()
                if film_s == 0.0:  # the first clip loads the kernels
                    film_s = 1e-9
                    continue
                seconds.update(
                    {
                        "voice": spoken - started,
                        "film": filmed - spoken,
                        "lips": measured - filmed,
                        "mfcc": done - measured,
                    }
                )
                film_s += heard.duration_s
            own_errors, took_s = true_error(own, one, planting.utter(one, everyone, SETTINGS, SEED))
            errors += own_errors
            per_frame_s.append(took_s)
    print(
        "CPU seconds per second of film: "
        + ", ".join(f"{step} {took / film_s:.3f}" for step, took in seconds.items())
    )
    print(
        f"alignment: {1e3 * np.mean(per_frame_s):.1f} ms per frame, error {np.mean(errors):.2f} px on average and "
        f"{np.max(errors):.2f} px at most"
    )


if __name__ == "__main__":
    main()

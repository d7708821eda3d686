"""Decoded videos have the expected frames and sound, and the same input gives the same bytes."""

import hashlib
import os

import av
import numpy as np
import pytest
import soundfile
from dancer import motion, phrases
from scipy import ndimage

from cospeech.formats import canvas, mp4
from cospeech.rendering import picture, video
from cospeech.studio import film as studio

FPS = 20.0
N_FRAMES = 50
HEIGHT = 120


def panels(n=1):
    return [video.Panel(f"system_{k}", motion(N_FRAMES, seed=k), phrases(N_FRAMES, seed=k)) for k in range(n)]


@pytest.fixture
def tone(tmp_path):
    """A tone of 440 Hz as long as the motion, at 16 kHz."""
    path = tmp_path / "tone.wav"
    soundfile.write(path, 0.3 * np.sin(2 * np.pi * 440 * np.arange(40000) / 16000), 16000)
    return path


def decode(path):
    with av.open(str(path)) as film:
        streams = {stream.type: stream for stream in film.streams}
        shown = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
        rate, lengths = streams["video"].average_rate, {}
        for kind, stream in streams.items():
            lengths[kind] = float(stream.duration * stream.time_base)
    sound = np.zeros(0)
    if "audio" in streams:
        with av.open(str(path)) as film:
            sound = np.concatenate([frame.to_ndarray()[0] for frame in film.decode(audio=0)])
    return shown, float(rate), lengths, sound


def test_few_flecks_remain_on_the_background(tmp_path):
    """Away from the figure, fewer than 0.2 % of the pixels differ visibly; faster presets leave 0.4 %."""
    drawn = [image.copy() for image in video.render(panels(), FPS, 300, "virtual")]
    mp4.encode(tmp_path / "a.mp4", iter(drawn), FPS)
    plain = picture.background(*video.panel_size(300))
    differing = []
    for ours, theirs in zip(drawn, decode(tmp_path / "a.mp4")[0], strict=True):
        background = ndimage.binary_erosion((ours == plain).all(axis=2), iterations=3)
        differing.append(np.abs(ours.astype(int) - theirs).max(axis=2)[background] > 8)
    assert np.mean(np.concatenate(differing)) < 0.002


def test_every_frame_and_the_sound_can_be_decoded(tmp_path, tone):
    path = tmp_path / "a.mp4"
    video.write_video(path, panels(2), "ada_1 · virtual", FPS, HEIGHT, None, tone)
    shown, rate, lengths, sound = decode(path)
    assert len(shown) == N_FRAMES
    assert rate == FPS
    height, width = video.panel_size(HEIGHT)
    assert shown[0].shape == (height, 2 * width, 3)
    assert lengths["video"] == pytest.approx(N_FRAMES / FPS)
    assert lengths["audio"] == pytest.approx(lengths["video"], abs=1 / FPS)
    spectrum = np.abs(np.fft.rfft(sound))
    assert np.argmax(spectrum) / len(sound) * 16000 == pytest.approx(440, abs=1)
    drawn = [image.copy() for image in video.render(panels(2), FPS, HEIGHT, "ada_1 · virtual")]
    for ours, theirs in zip(drawn, shown, strict=True):
        error = np.mean((ours.astype(float) - theirs) ** 2)
        assert 10 * np.log10(255**2 / error) > 28  # dB; the videos are strongly compressed


def test_footage_is_shown_in_sync_with_the_motion(tmp_path):
    """Each picture of the film has a different brightness; a video at half the frame rate shows every second one."""
    planes = [np.stack([np.full((48, 64), y, np.uint8), *(np.full((48, 64), 128, np.uint8),) * 2]) for y in range(50)]
    studio.encode(tmp_path / "c3.mkv", planes, FPS)
    path = tmp_path / "a.mp4"
    video.write_video(path, panels(), "ada_1", FPS / 2, HEIGHT, None, None, tmp_path / "c3.mkv")
    shown, *_ = decode(path)
    height, width = video.panel_size(HEIGHT)
    assert shown[0].shape == (height, 2 * width, 3)
    middle = [float(picture[40:80, 40 : width - 40].mean()) for picture in shown]
    np.testing.assert_allclose(middle, np.arange(1, 50, 2), atol=3)


def test_the_bytes_do_not_depend_on_the_number_of_cores(tmp_path, tone):
    cores = os.sched_getaffinity(0)
    digests = set()
    try:
        for number, allowed in enumerate((cores, cores, {min(cores)})):
            os.sched_setaffinity(0, allowed)
            path = tmp_path / f"{number}.mp4"
            video.write_video(path, panels(2), "ada_1 · virtual", FPS, HEIGHT, None, tone)
            digests.add(hashlib.sha256(path.read_bytes()).hexdigest())
    finally:
        os.sched_setaffinity(0, cores)
    assert len(digests) == 1


def test_a_video_contains_no_encoder_name_and_no_date(tmp_path):
    path = tmp_path / "a.mp4"
    video.write_video(path, panels(), "", FPS, HEIGHT, None, None)
    with av.open(str(path)) as film:
        assert "encoder" not in film.metadata
        assert "creation_time" not in film.metadata
        assert not film.streams.audio


@pytest.mark.parametrize("fps", [10.0, 25.0, 29.97])
def test_the_duration_does_not_depend_on_the_frame_rate(tmp_path, tone, fps):
    path = tmp_path / "a.mp4"
    video.write_video(path, panels(), "", fps, HEIGHT, None, tone)
    shown, rate, lengths, _ = decode(path)
    assert len(shown) == video.n_video_frames(panels()[0].motion, fps) == round(N_FRAMES / FPS * fps)
    assert rate == pytest.approx(fps, rel=1e-4)
    assert lengths["audio"] == pytest.approx(lengths["video"], abs=1 / fps)


def test_the_timeline_shows_phrases_and_cursor():
    shown = phrases(N_FRAMES, seed=1)
    timeline = picture.Timeline(shown, N_FRAMES / FPS, (10, 20, 110, 26))
    image = np.full((40, 120, 3), 255, dtype=np.uint8)
    timeline.draw(image)
    for label, start, end in zip(shown["label"], shown["start_s"], shown["end_s"], strict=True):
        if end - start > 0.1:  # four pixels
            column = round(10 + 100 * (start + end) / 2 / (N_FRAMES / FPS))
            assert tuple(image[23, column]) == picture.gesture_colour(label)
    timeline.draw_cursor(image, N_FRAMES / FPS / 2)
    assert tuple(image[18, 60]) == canvas.INK


def test_every_gesture_has_a_label_and_text_stays_inside_the_image():
    for label in ("rest", "raise_both", "a_custom_class"):
        colours, shape = picture.tag(label, 12)
        assert colours.shape[:2] == shape.shape
        assert shape.max() == pytest.approx(1)
    image = np.full((24, 20, 3), 255, dtype=np.uint8)
    canvas.write(image, "a long text in a small image", 5, 12, 14)
    assert (image != 255).any()


def test_only_the_beginning_of_a_long_record_is_shown(tmp_path, tone):
    path = tmp_path / "a.mp4"
    shorter = [panel.head(30) for panel in panels(2)]
    for panel in shorter:
        assert len(panel.motion) == 30
        assert panel.phrases["end_s"].iloc[-1] == 30 / FPS
    video.write_video(path, panels(2), "ada_1", FPS, HEIGHT, 1.5, tone)
    shown, _, lengths, _ = decode(path)
    assert len(shown) == 30
    assert lengths["audio"] == pytest.approx(1.5, abs=1 / FPS)
    drawn = [image.copy() for image in video.render(shorter, FPS, HEIGHT, "ada_1 · first 1.5 s")]
    errors = [np.mean((ours.astype(float) - theirs) ** 2) for ours, theirs in zip(drawn, shown, strict=True)]
    assert 10 * np.log10(255**2 / max(errors)) > 28  # dB, as above
    video.write_video(tmp_path / "b.mp4", panels(2), "ada_1", FPS, HEIGHT, 2.5, tone)
    video.write_video(tmp_path / "c.mp4", panels(2), "ada_1", FPS, HEIGHT, None, tone)
    assert (tmp_path / "b.mp4").read_bytes() == (tmp_path / "c.mp4").read_bytes()

"""Estimates of the run time are proportional to the amount of work."""

import copy

import pytest
import yaml

from cospeech.data.tables import schema_folder
from cospeech.workflow import time_estimate

DEMO = yaml.safe_load((schema_folder().parent / "config" / "demo.yaml").read_text(encoding="utf-8"))
FILMS = {"studio_film": 8, "track": 10, "studio_range": 2, "studio_laser": 1, "laser": 1}


def test_no_job_takes_no_time_and_a_small_job_only_its_start():
    assert time_estimate.seconds({}, DEMO, 5, 9) == 0.0
    assert time_estimate.seconds({"page": 1}, DEMO, 5, 9) == time_estimate.START_S


def test_the_time_of_films_is_proportional_to_their_pixels():
    small = time_estimate.seconds({"studio_film": 8}, DEMO, 5, 0) - 8 * time_estimate.START_S
    assert small == pytest.approx(8 * 60 * 20 * 5 * time_estimate.PICTURE_S["studio_film"])
    large = copy.deepcopy(DEMO)
    large["studio"]["camera_width_px"] *= 2
    for actor in large["studio"]["actors"]:
        actor["duration_s"] *= 3
    assert time_estimate.seconds({"studio_film": 8}, large, 5, 0) - 8 * time_estimate.START_S == pytest.approx(
        12 * small
    )


def test_the_time_of_a_sweep_is_proportional_to_its_settings():
    one, ten = (time_estimate.seconds({"sweep_settings": 1}, DEMO, 0, n) - time_estimate.START_S for n in (1, 10))
    assert ten == pytest.approx(10 * one)


def test_the_line_states_jobs_time_and_disk_space_for_films():
    line = time_estimate.line(FILMS, DEMO, 5, 0, 2)
    assert line.startswith("22 jobs, about 0:0")
    assert line.endswith("on 2 cores; 0.5 GB of film")
    assert time_estimate.line({"studio_film": 2}, DEMO, 5, 0, 2).endswith("0.1 GB of film")
    assert "film" not in time_estimate.line({"page": 1}, DEMO, 5, 0, 2)


def test_the_time_of_a_video_is_proportional_to_the_shown_duration():
    seconds = []
    for longest_s in (30, 60, 90, None):
        config = copy.deepcopy(DEMO)
        config["animation"]["video"]["longest_s"] = longest_s
        seconds.append(time_estimate.seconds({"comparison": 1}, config, 5, 0) - time_estimate.START_S)
    assert seconds[1:] == pytest.approx([2 * seconds[0]] * 3)

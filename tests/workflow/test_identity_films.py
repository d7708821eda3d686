"""From films of speakers to features: a virtual population, then the same films in a sheet of a user."""

import pandas as pd
import pytest
import yaml
from project import Project

pytestmark = [pytest.mark.workflow, pytest.mark.slow, pytest.mark.xdist_group("identity_films")]

POPULATION = {"speakers": 2, "repetitions": 2, "others": 1, "sessions": 2}
RAW = "results/population/corpus/raw"
FIRST = "results/population/identity/lips/s1.parquet"


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    project = Project(tmp_path_factory.mktemp("population"))
    config = {"run": "population", "studio": {"population": POPULATION}, "identity": {"population": True}}
    (project.folder / "population.yaml").write_text(yaml.safe_dump(config))
    audio = "results/population/identity/audio/s1.parquet"
    project.make("results/population/identity/clips.parquet", audio, FIRST, config=project.folder / "population.yaml")
    return project


@pytest.fixture(scope="module")
def population(project):
    return project.folder / "results" / "population"


def test_every_clip_has_a_film_a_sound_and_features_of_both(project, population):
    clips = pd.read_parquet(population / "identity" / "clips.parquet")
    assert clips["clip"].tolist() == [f"s{s}_{name}" for s in (1, 2) for name in ("own_1", "own_2", "other_1")]
    own = clips[clips["speaker"] == "s1"]
    assert all((project.folder / path).is_file() for path in [*own["film"], *own["sound"]])
    audio = pd.read_parquet(population / "identity" / "audio" / "s1.parquet").groupby("clip").size()
    lips = pd.read_parquet(population / "identity" / "lips" / "s1.parquet").groupby("clip").size()
    for clip in own.itertuples():
        assert audio[clip.clip] == pytest.approx(100 * clip.duration_s, abs=1)
        assert lips[clip.clip] == pytest.approx(15 * clip.duration_s, abs=1)


def test_the_same_films_in_a_sheet_give_the_same_lips_and_a_bad_line_is_reported(project, population):
    lines = [f"{RAW}/s1/s1_{name}.mkv,ada,Ada Can,1,{RAW}/s1/s1_{name}.wav" for name in ("own_1", "own_2")]
    lines.append(f"{RAW}/s1/s1_other_1.mkv,ada,Umut Er,1,")
    sheet = "file,speaker,phrase,session,sound\n" + "\n".join(lines) + "\n"
    (project.folder / "own.csv").write_text(sheet, encoding="utf-8")
    config = {
        "run": "own",
        "corpus": {"source": "recorded", "name": "own"},
        "identity": {"sheet": "own.csv"},
    }
    (project.folder / "own.yaml").write_text(yaml.safe_dump(config))
    said = project.make(
        *(f"results/own/identity/{kind}/sheet.parquet" for kind in ("audio", "lips")),
        config=project.folder / "own.yaml",
    )
    assert "own.csv: line 4 is left out: " in said
    assert "s1_other_1.mkv: has no sound; name its sound file in column 'sound'" in said
    own = pd.read_parquet(project.folder / "results/own/identity/lips/sheet.parquet")
    first = pd.read_parquet(population / "identity" / "lips" / "s1.parquet")
    first = first[first["clip"] != "s1_other_1"].reset_index(drop=True)
    pd.testing.assert_frame_equal(own, first)


def test_a_changed_film_of_a_sheet_is_measured_again(project):
    config = project.folder / "own.yaml"
    tables = [f"results/own/identity/{kind}/sheet.parquet" for kind in ("audio", "lips")]
    assert project.planned(*tables, config=config) == set()
    film = project.folder / RAW / "s1" / "s1_own_1.mkv"
    film.write_bytes(film.read_bytes() + bytes(8))
    assert {"clips", "mfcc", "lips"} <= project.planned(*tables, config=config)

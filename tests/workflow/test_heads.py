"""Runs of heads without bodies: records from files, a report without gesture phrases, and nothing left to do."""

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from project import Project

from cospeech.speech import melody

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]

CONFIG = """
run: heads
corpus:
  source: recorded
  name: planted
  head: {{ order: {order}, unit: rad, up: -y, facing: -z, columns: {{ time: t, x: rx, y: ry, z: rz }} }}
  records:
    - {{ record: eda_1, actor: eda, melody: eda_1.melody.csv, head: eda_1.head.csv }}
    - {{ record: eda_2, actor: eda, melody: eda_2.melody.csv, head: eda_2.head.csv }}
synthesis:
  systems: {{ head_weighted: false, iohmm: false, iohmm_ahead: false, head_ceiling: false, head: {{ restarts: 1 }} }}
animation: {{ video: {{ fps: 5, height_px: 120, longest_s: 1 }} }}
evaluation: {{ bootstrap: {{ samples: 100, level: 0.95 }} }}
report: {{ title: "Heads" }}
"""


def plant(folder, name, seed, seconds=24):
    """A pitch that rises and falls, and a head that turns with it, in the axes of a camera and in radians."""
    rng = np.random.default_rng(seed)
    frames = np.arange(100 * seconds)
    course = np.sin(frames / rng.uniform(25.0, 40.0))
    f0_hz = np.where(frames % 400 < 320, 150.0 + 30.0 * course, np.nan)
    table = melody.table(name, f0_hz, -30.0 + 5.0 * course + rng.normal(0.0, 1.0, len(frames)), 0)
    table.to_csv(folder / f"{name}.melody.csv", index=False)
    turn = np.radians(15.0 * course[::4]) + rng.normal(0.0, 0.005, len(frames) // 4)
    head = {
        "t": (np.arange(len(turn)) + 0.5) / 25.0,
        "rx": 0.3 * turn,
        "ry": -turn,
        "rz": rng.normal(0.0, 0.01, len(turn)),
    }
    pd.DataFrame(head).to_csv(folder / f"{name}.head.csv", index=False)


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    made = Project(tmp_path_factory.mktemp("heads"))
    for seed, name in enumerate(("eda_1", "eda_2")):
        plant(made.folder, name, seed)
    (made.folder / "heads.yaml").write_text(CONFIG.format(order="XYZ"), encoding="utf-8")
    return made


def test_an_undeclared_order_is_one_line_that_names_the_record(project):
    undeclared = project.folder / "undeclared.yaml"
    undeclared.write_text(CONFIG.format(order="null").replace("run: heads", "run: undeclared"), encoding="utf-8")
    ended = project.run("--until", "record", config=undeclared)
    assert ended.returncode != 0
    assert (
        "record 'eda_1': eda_1.head.csv: its angles come without their order; declare corpus.head.order"
        in ended.stdout
    )


def test_heads_alone_give_scores_pictures_and_a_report_without_gesture_phrases(project):
    said = project.make(config=project.folder / "heads.yaml")
    assert "are left out: the records bring a head and no body" in said
    results, reports = project.folder / "results/heads", project.folder / "reports/heads"
    head = pq.read_table(results / "head/eda_1.parquet").to_pandas()
    assert head["y_deg"].abs().max() > 12.0
    scores = pq.read_table(results / "evaluation/head_scores.parquet").to_pandas()
    assert {"head", "head_shuffled", "head_still", "head_mean"} <= set(scores["system"])
    still = scores[(scores["system"] == "head_still") & (scores["measure"] == "normalised")]["value"]
    np.testing.assert_allclose(still, 1.0)
    assert not (results / "phrases").exists()
    figures = {path.stem for path in (reports / "figures").glob("*.png")}
    assert {"head-table-4.1", "head-fig-4.7", "head-fig-4.9", "fig-head-strip"} <= figures
    page = (reports / "index.html").read_text(encoding="utf-8")
    assert "the systems of this run move nothing but heads" in page
    assert project.problems("heads") == []
    assert "Nothing to be done" in project.make(config=project.folder / "heads.yaml")

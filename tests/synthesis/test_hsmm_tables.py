"""The tables of the HSMM: a model comes back from them unchanged, and they alone give the score of a path."""

import numpy as np
import pandas as pd
import pytest
from path_score import score_by_rows

from cospeech.data import segments, tables, vocabulary
from cospeech.errors import UserError
from cospeech.markov import hsmm
from cospeech.synthesis.hsmm.tables import TABLES, from_tables, to_tables

FRAME_S = 0.025


def model_of(rng, n_bins, floor=1e-6):
    """A floored model of all gestures, in reverse order, and eight prosody clusters, some probabilities zero."""

    def rows(*shape):
        return rng.dirichlet(np.full(shape[-1], 0.7), shape[:-1]) * (rng.random(shape) < 0.7)

    n_gestures = len(vocabulary.GESTURES)
    drawn = hsmm.HSMM(
        states=vocabulary.GESTURES[::-1],
        symbols=vocabulary.prosody_labels(8),
        initial=rows(n_gestures),
        transitions=rows(n_gestures, n_gestures),
        emissions=rows(n_gestures, 8),
        durations=rows(n_gestures, n_bins),
    )
    return hsmm.floored(drawn, floor)


def test_a_model_comes_back_from_its_files_unchanged(tmp_path):
    model = model_of(np.random.default_rng(3), 400)
    written = to_tables(model, FRAME_S, 1e-6)
    assert tuple(written) == TABLES
    for name in TABLES:
        tables.write(written[name], tmp_path / f"{name}.parquet", name, corpus="virtual", config_hash="0")
    again = from_tables({name: tables.read(tmp_path / f"{name}.parquet", name) for name in TABLES})
    assert (again.states, again.symbols) == (model.states, model.symbols)
    for name in TABLES:
        np.testing.assert_array_equal(getattr(again, name), getattr(model, name))
        np.testing.assert_allclose(getattr(again, name).sum(axis=-1), 1.0, atol=1e-12)
        assert set(written[name]["floor"]) == {1e-6}


@pytest.mark.parametrize("censoring", ["none", "right"])
@pytest.mark.parametrize("weight", [1.0, 0.2, 0.0])
def test_the_score_of_a_long_path_follows_from_the_tables(weight, censoring):
    rng = np.random.default_rng(3)
    model = model_of(rng, 400)
    observed = np.array(model.symbols, dtype=object)[np.repeat(rng.integers(8, size=200), 12)]
    written = to_tables(model, FRAME_S)
    for path in (
        hsmm.decode(model, observed, weight, censoring),
        hsmm.sample(model, observed, np.random.default_rng(5), weight, censoring),
    ):
        phrases = segments.from_starts("r", path.starts, path.labels, len(observed), 1 / FRAME_S)
        score = score_by_rows(written, phrases, observed, weight, censoring)
        assert path.log_score == pytest.approx(score, abs=1e-9)


def test_the_order_of_rows_does_not_matter_except_for_the_names():
    model = model_of(np.random.default_rng(4), 5)
    written = to_tables(model, FRAME_S)
    for name in ("transitions", "durations"):
        written[name] = written[name].iloc[::-1]
    again = from_tables(written)
    np.testing.assert_array_equal(again.transitions, model.transitions)
    np.testing.assert_array_equal(again.durations, model.durations)


def test_what_is_missing_or_unknown_is_named():
    model = model_of(np.random.default_rng(0), 3)
    written = to_tables(model, FRAME_S)
    lacking = written | {"transitions": written["transitions"].iloc[1:]}
    with pytest.raises(UserError, match="transitions table: lacks from_gesture 'right', to_gesture 'right'"):
        from_tables(lacking)
    unknown = pd.concat([written["emissions"], written["emissions"].replace("rest", "wave")])
    with pytest.raises(UserError, match="emissions table: has a row of a gesture"):
        from_tables(written | {"emissions": unknown})

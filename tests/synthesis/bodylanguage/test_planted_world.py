"""Body language in the studio's world ``syllables``, which plants what the thesis assumes (Levine 2009, 4.2-4.3)."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy import special

from cospeech.segmentation import subunits
from cospeech.studio import features, motion, performance, scenes, worlds
from cospeech.studio.syllables import LEVELS
from cospeech.synthesis import live
from cospeech.synthesis.bodylanguage import alignment, chain, model, observations, proposed, report
from cospeech.synthesis.interface import Speech, Training

SEED, FRAME_S, FPS, DURATION_S, NOISE_DEG = 2012, 0.025, 20.0, 120.0, 0.4
SECTIONS = ("head", "arms")
"""The sections whose strokes stand out from the noise of the motion; those of the legs turn joints by little."""


def scenes_of(n_records, coupling):
    own = scenes.player("ada", "syllables", SEED, FRAME_S, 10.0)
    couplings = worlds.couplings("syllables", coupling, {})
    written = [scenes.write(own, f"ada_{k}", DURATION_S, couplings, FRAME_S, SEED) for k in range(n_records)]
    return own, {f"ada_{k}": scene for k, scene in enumerate(written)}


@pytest.fixture(scope="module")
def recorded():
    """Three records: scenes, syllables, motion, and the subunits found in it with the settings of the demo."""
    settings = yaml.safe_load(Path("config/demo.yaml").read_text(encoding="utf-8"))["segmentation"]["subunits"]
    _, written = scenes_of(3, 0.8)
    spoken, moved = {}, {}
    for record, scene in written.items():
        spoken[record] = features.speech(record, scene, 200.0, FRAME_S, 0.4, SEED).syllables
        performed = performance.perform("ada", record, scene, FPS, SEED)
        moved[record] = motion.with_sensor_noise(performed, NOISE_DEG, record, SEED)
    return written, spoken, moved, subunits.find(moved, settings)


def test_planted_strokes_are_found_in_the_motion(recorded):
    """Most boundaries have one within 150 ms, half of them within 75 ms, and they are not late."""
    written, _, _, found = recorded
    for section in SECTIONS:
        errors_s = []
        for record, scene in written.items():
            planted = scene.subunits.query("section == @section")["start_s"].to_numpy()[1:]
            table = found[section]
            own = table[table["record"] == record]["start_s"].to_numpy()
            errors_s.append(own[np.abs(own[:, None] - planted).argmin(axis=0)] - planted)
        error_s = np.concatenate(errors_s)
        assert (np.abs(error_s) < 0.15).mean() > {"head": 0.75, "arms": 0.85}[section]
        assert np.median(np.abs(error_s)) < 0.075
        assert abs(np.median(error_s)) < 0.05


def test_hardly_any_subunit_is_without_an_observation(recorded):
    """The thesis found less than 0.4 % of them (4.2)."""
    written, spoken, _, found = recorded
    wait_s = observations.waiting_time_s(spoken.values())
    heard = {
        record: observations.observe(syllables, DURATION_S, FRAME_S, wait_s) for record, syllables in spoken.items()
    }
    for table in found.values():
        paths = [alignment.align(heard[record], table[table["record"] == record]) for record in written]
        assert alignment.skipped_share(paths, len(table)) < 0.004


def half_way_s(turning):
    """The time at which half of the turning is done, relative to the start."""
    done = np.append(0.0, np.cumsum(turning))
    return np.interp(done[-1] / 2, done, np.arange(len(done))) / FPS


def test_strokes_of_the_system_are_done_when_they_are_planned(recorded):
    """Blending does not delay a stroke: half of it is done within 50 ms of the same moment in its recording."""
    _, spoken, moved, found = recorded
    *others, held_out = moved
    sections = {
        record: {section: table[table["record"] == record] for section, table in found.items()} for record in others
    }
    training = Training(
        "ada",
        FRAME_S,
        (),
        (),
        {},
        {},
        motions={record: moved[record] for record in others},
        syllables={record: spoken[record] for record in others},
        subunits=sections,
    )
    trained = model.train(training, {"elapsed": "exact", "pose_tolerance_deg": 5.0, "blending": "velocity"})
    n_frames = len(moved[held_out])
    driving = Speech(
        held_out,
        FRAME_S,
        round(DURATION_S / FRAME_S),
        syllables=spoken[held_out],
        motion_fps=FPS,
        n_motion_frames=n_frames,
    )
    made = live.motion_table(live.all_steps(proposed, trained, driving, SEED), FPS)
    stream = live.Stream(held_out, FRAME_S, FPS)
    decided = report.decisions(trained, proposed.start(trained, stream, SEED), driving).query("section == 'arms'")
    turning = {record: subunits.angular_speed(table, "arms", FPS) for record, table in [*moved.items(), ("", made)]}
    errors_s = []
    for record, segment, first, end in zip(
        decided["record"], decided["segment"], decided["frame"], decided["frame"].iloc[1:], strict=False
    ):
        row = sections[record]["arms"].set_index("segment").loc[segment]
        if not row["still"] and end - first >= 5:
            own = turning[record][row["start_frame"] : row["start_frame"] + end - first]
            errors_s.append(half_way_s(turning[""][first:end]) - half_way_s(own))
    assert len(errors_s) > 100
    assert (np.abs(errors_s) <= 0.05).mean() > 0.9


@pytest.fixture(scope="module")
def planted_steps():
    """All planted syllables of 24 minutes at which a subunit may end.

    Returns
    -------
    The streams, and by section: (M,) the kind, the elapsed share, whether it goes on, and the next kind.
    """
    own, written = scenes_of(12, 1.0)
    steps = {}
    for section, stream in own.streams.items():
        rows = []
        for scene in written.values():
            peaks = np.sort(scene.syllables.query("followed")["peak_s"].to_numpy())[1:]
            table = scene.subunits.query("section == @section")
            kinds = np.array([stream.kinds.index(kind) for kind in table["subunit"]])
            starts = table["start_s"].to_numpy()
            row = np.searchsorted(starts, peaks - 1e-9) - 1
            ends = np.isin(peaks, starts)
            elapsed = (peaks - starts[row]) / stream.nominal_s[kinds[row]]
            rows.append((kinds[row], elapsed, ~ends, kinds[np.minimum(row + 1, len(kinds) - 1)]))
        steps[section] = [np.concatenate(column) for column in zip(*rows, strict=True)]
    return own.streams, steps


def test_planted_continuations_are_recovered_through_the_studio(planted_steps):
    """f_i at the quartiles of the elapsed share, within four standard errors."""
    streams, steps = planted_steps
    for section, stream in streams.items():
        kind, elapsed, goes_on, _ = steps[section]
        found = chain.regression(kind, elapsed, goes_on, len(stream.kinds))
        for i, (intercept, slope) in enumerate(found):
            own = elapsed[kind == i]
            shares = np.quantile(own, [0.25, 0.5, 0.75])
            true = special.expit(-stream.slope[i] * (shares - stream.middle[i]))
            each = np.column_stack([np.ones(len(own)), own])
            weight = special.expit(-stream.slope[i] * (own - stream.middle[i]))
            information = (each * (weight * (1.0 - weight))[:, None]).T @ each
            at = np.column_stack([np.ones(3), shares])
            error = np.sqrt(np.einsum("ij,jk,ik->i", at, np.linalg.inv(information), at)) * true * (1.0 - true)
            assert (np.abs(special.expit(intercept + slope * shares) - true) <= 4.0 * error).all()


def test_planted_successors_are_recovered_through_the_studio(planted_steps):
    """Shares of the next kinds, within four standard errors of what follows from T and the syllables' weights."""
    streams, steps = planted_steps
    shares = [np.array(levels) for levels in LEVELS.values()]
    for section, stream in streams.items():
        kind, _, goes_on, following = steps[section]
        n = len(stream.kinds)
        counts = np.zeros((n, n))
        np.add.at(counts, (kind[~goes_on], following[~goes_on]), 1.0)
        expected = np.einsum("a,b,c,abcij->ij", *shares, stream.following())
        total = counts.sum(axis=1, keepdims=True)
        error = np.sqrt(expected * (1.0 - expected) / total)
        assert (np.abs(counts / total - expected) <= 4.0 * error).all()

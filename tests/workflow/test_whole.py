"""The whole workflow at its smallest: it ends, what it made keeps the contract, and it makes it again to the byte."""

import pyarrow.parquet as pq
import pytest
from kills import kill_and_resume
from project import Project, differing

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]


def test_everything_that_was_made_is_whole(finished):
    assert (finished.folder / "reports/test/index.html").stat().st_size > 10_000
    assert finished.problems() == []


def test_every_exhibit_of_the_thesis_is_there(finished):
    figures = {path.stem for path in (finished.folder / "reports/test/figures").glob("*.svg")}
    tables = {path.stem for path in (finished.folder / "reports/test/tables").glob("*.csv")}
    # fig-7.4 is fig-7.3 of the second actor, and this corpus has one.
    assert {"fig-6.3", "fig-7.2a", "fig-7.2b", "fig-7.3", "fig-7.5"} <= figures
    assert {"table-3-scenarios", "table-4.1", "leaderboard"} <= tables


CONTRACT = {
    "corpus/records.parquet": "actor record scenario language motion_source motion_fps audio_rate_hz duration_s",
    "corpus/annotations.parquet": "record start_s end_s gesture origin",
    "motion/ada_1.parquet": "frame time_s root_x_m root_y_m root_z_m left_arm_x_deg right_forearm_z_deg",
    "speech/ada_1/pitch.parquet": "frame time_s f0_hz",
    "speech/ada_1/prosody.parquet": "frame time_s intensity pitch_lag pitch_gain d_intensity d_pitch_lag "
    "d_pitch_gain intensity_log lag_s",
    "segmentation/phases/ada_1.parquet": "record phase start_frame end_frame start_s end_s temporal_extent "
    "spatial_extent velocity acceleration curvature height",
    "segmentation/subunits/head/ada_1.parquet": "record segment start_frame end_frame start_s end_s cluster still",
    "segmentation/subunits/arms/ada_1.parquet": "record segment start_frame end_frame start_s end_s cluster still",
    "segmentation/subunits/legs/ada_1.parquet": "record segment start_frame end_frame start_s end_s cluster still",
    "phrases/gesture/ada_1.parquet": "record segment start_frame end_frame start_s end_s label",
    "phrases/prosody/clusters~4/states~3/fold~ada_1/segments.parquet": "record segment start_frame end_frame label",
    "phrases/prosody/clusters~4/states~3/fold~ada_1/model.parquet": "branch state entry_probability "
    "stay_probability feature mean variance",
    "phrases/prosody/clusters~4/states~3/fold~ada_1/fit.parquet": "restart iteration log_likelihood alpha beta",
    "synthesis/hsmm/clusters~4,states~3/ada_1/phrases.parquet": "record segment start_frame end_frame label",
    "synthesis/hsmm/clusters~4,states~3/ada_1/initial.parquet": "gesture probability",
    "synthesis/hsmm/clusters~4,states~3/ada_1/transitions.parquet": "from_gesture to_gesture probability",
    "synthesis/hsmm/clusters~4,states~3/ada_1/emissions.parquet": "gesture prosody probability",
    "synthesis/hsmm/clusters~4,states~3/ada_1/durations.parquet": "gesture bin duration_s probability",
    "synthesis/hsmm_weighted/clusters~4,states~3/ada_1/decoding.parquet": "record log_score emission_weight "
    "censoring",
    "synthesis/hsmm/clusters~4,states~3/ada_1/units.parquet": "segment label template_record template_segment "
    "duration_penalty continuity_penalty",
    "synthesis/hsmm/clusters~4,states~3/ada_1/motion.parquet": "frame time_s root_x_m left_arm_x_deg",
    "synthesis/hsmm/clusters~4,states~3/ada_1/phrases_seen.parquet": "record segment start_frame end_frame label",
    "synthesis/original/main/ada_1/phrases_seen.parquet": "record segment start_frame end_frame label",
    "evaluation/record_scores.parquet": "system variant actor record phrases measure part gesture bin_s value "
    "n_actual n_synthesised duration_s",
    "evaluation/session_scores.parquet": "system variant actor phrases measure part bin_s value low "
    "high n n_undefined",
}


@pytest.mark.parametrize("path", CONTRACT)
def test_paths_and_columns_keep_the_contract(finished, path):
    table = pq.read_table(finished.folder / "results/test" / path, page_checksum_verification=True)
    assert set(CONTRACT[path].split()) <= set(table.column_names)
    assert {b"schema", b"schema_version", b"corpus", b"config_hash"} <= set(table.schema.metadata)
    assert table.schema.metadata[b"corpus"] == b"virtual"


VARIANTS = dict.fromkeys(
    ("hsmm", "hsmm_weighted", "hsmm_sampled", "prior", "shuffled", "shifted"), "clusters~4,states~3"
) | dict.fromkeys(("random", "clock", "majority", "another", "oracle"), "main")


@pytest.mark.parametrize("system", VARIANTS)
def test_every_system_writes_its_phrases_and_how_it_decoded(finished, system):
    folder = finished.folder / "results/test/synthesis" / system / VARIANTS[system] / "ada_1"
    assert {"phrases.parquet", "decoding.parquet"} <= {path.name for path in folder.iterdir()}


def test_a_second_run_has_nothing_to_do(finished):
    assert "Nothing to be done" in finished.make()


def test_the_default_profile_is_used_without_being_named(finished):
    assert "profiles/default" in finished.make("--dry-run").splitlines()[0]


@pytest.mark.slow
def test_one_core_and_five_kills_give_the_bytes_of_an_undisturbed_run_on_two_cores(finished, tmp_path):
    project = Project(tmp_path)
    assert kill_and_resume(project, kills=5, seed=2012, cores=1) == 5
    assert differing(finished.artifacts(), project.artifacts()) == []
    assert project.problems() == []

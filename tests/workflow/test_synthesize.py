"""``cospeech synthesize`` and the workflow make the same motion from the same model."""

import subprocess
import sys

import pytest

pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]

RECORD, VARIANT = "ada_1", "clusters~4,states~3"


@pytest.mark.parametrize("system", ["hsmm_weighted", "hsmm_sampled"])
def test_the_model_of_a_fold_gives_the_motion_of_the_workflow_to_the_byte(copy, system):
    results = copy.folder / "results" / "test"
    model = f"results/test/models/{system}/{VARIANT}/fold~{RECORD}"
    copy.make(model)
    program = "import sys; from cospeech import cli; sys.exit(cli.main())"
    sound, body = results / "corpus" / "audio" / f"{RECORD}.wav", results / "motion" / f"{RECORD}.parquet"
    options = ["--model", model, "--body", str(body), "--format", "bvh", "--out", "out"]
    ended = subprocess.run(
        [sys.executable, "-c", program, "synthesize", str(sound), *options],
        cwd=copy.folder, env=copy.environment, text=True, capture_output=True,
    )  # fmt: skip
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, f"out/{RECORD}.bvh\n", "")
    of_workflow = results / "synthesis" / system / VARIANT / RECORD / "motion.bvh"
    assert (copy.folder / "out" / f"{RECORD}.bvh").read_bytes() == of_workflow.read_bytes()

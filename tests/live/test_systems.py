"""The systems that run live: while somebody speaks they make the motion of the recording, to the last bit."""

import numpy as np
import pytest
from stand_in import Chunks, run

from cospeech import api
from cospeech.data import tables
from cospeech.errors import UserError
from cospeech.live import engine, performing
from cospeech.live.hearing import STREAM
from cospeech.live.recording import Recorder
from cospeech.motion.body import STANDARD
from cospeech.synthesis import bodylanguage, controller

SYSTEMS = {system.name: system for system in (*controller.SYSTEMS, *bodylanguage.SYSTEMS) if system.live}


@pytest.fixture(scope="module")
def trained(recordings):
    """The model of each system, trained on 24 seconds of the virtual actor."""
    records = [
        api.load_record(recordings / f"{name}.bvh", recordings / f"{name}.wav") for name in ("talk_1", "talk_2")
    ]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(api, "installed", SYSTEMS.__getitem__)
        yield {name: api.train(records, name) for name in ("controller", "bodylanguage")}


@pytest.mark.parametrize("name", ["controller", "bodylanguage"])
@pytest.mark.parametrize("size", [777, 100_000])
def test_live_motion_is_that_of_the_recording(trained, samples, tmp_path, name, size):
    model = trained[name]
    spoken = samples[:98_765]
    fps = model.card["motion_fps"]
    recorder = Recorder(tmp_path / "x.parquet", STANDARD, fps, model.card | {"corpus": "virtual"}, False, print)
    run(model, Chunks(spoken, size), [recorder], seed=5, fps=fps)
    expected = api.synthesize(spoken, model, record=STREAM, seed=5).motion
    assert tables.read(tmp_path / "x.parquet", "motion").equals(expected)
    assert np.ptp(expected["left_forearm_x_deg"]) > 1.0


def test_a_style_changes_the_motion_and_an_unknown_one_names_those_that_exist(trained, samples):
    model = trained["controller"]
    made = performing.performer(model, engine.listening(model, 16000), 0)
    with pytest.raises(UserError, match=r"'sleepy'; its styles: .*energetic"):
        made.prepare("style:sleepy", 1.0)
    made.prepare("style:energetic", 1.0)()

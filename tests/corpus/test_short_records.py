"""Records that are too short for a control are noted with their duration, and known before any file is read fully."""

import numpy as np
import pandas as pd
import pytest
import soundfile

from cospeech.corpus.short_records import noted
from cospeech.workflow import short_records


def table():
    return pd.DataFrame({"record": ["a", "b", "c"], "duration_s": [14.5, 14.4, 9.0], "note": [None, None, "clipped"]})


def test_short_records_get_a_note_after_their_own():
    found = noted(table(), 14.5, 5.0)["note"].tolist()
    assert found == [
        None,
        "14.4 s are too short for a shift of 5 s: left out of the controls with shifted speech",
        "clipped; 9.0 s are too short for a shift of 5 s: left out of the controls with shifted speech",
    ]
    pd.testing.assert_frame_equal(noted(table(), None, 5.0), table())


CONFIG = {
    "corpus": {"source": "recorded"},
    "speech": {"frame_s": 0.025},
    "synthesis": {"shift_s": 5},
    "studio": {"actors": [{"actor": "ada", "duration_s": 12}]},
}
EMPTY = {"actor": "ada", "start_s": None, "end_s": None, "audio": None, "prosody": None}


def test_short_records_are_named_by_what_is_known_without_reading_them(tmp_path):
    soundfile.write(tmp_path / "short.wav", np.zeros(16000 * 9), 16000)
    soundfile.write(tmp_path / "long.wav", np.zeros(8000 * 20), 8000, subtype="FLOAT")
    (tmp_path / "broken.wav").write_bytes(b"RIFF")
    pd.DataFrame({"frame": range(400)}).to_parquet(tmp_path / "prosody.parquet")
    records = {
        "short": EMPTY | {"audio": str(tmp_path / "short.wav")},
        "long": EMPTY | {"audio": str(tmp_path / "long.wav")},
        "rest_of_long": EMPTY | {"audio": str(tmp_path / "long.wav"), "start_s": 12.5},
        "excerpt": EMPTY | {"audio": str(tmp_path / "long.wav"), "start_s": 2.0, "end_s": 8.0},
        "broken": EMPTY | {"audio": str(tmp_path / "broken.wav")},
        "frames": EMPTY | {"prosody": str(tmp_path / "prosody.parquet")},
        "unknown": EMPTY | {"prosody": str(tmp_path / "prosody.csv")},
    }
    assert short_records.durations(CONFIG, records) == pytest.approx(
        {"short": 9.0, "long": 20.0, "rest_of_long": 7.5, "excerpt": 6.0, "frames": 10.0}
    )
    lines = short_records.lines(CONFIG, records, 14.5)
    assert [line.split("'")[1] for line in lines] == ["short", "rest_of_long", "excerpt", "frames"]
    assert lines[0].startswith("record 'short': its 9.0 s are too short for a shift of 5 s")


def test_the_duration_of_virtual_records_is_configured():
    config = CONFIG | {"corpus": {"source": "studio"}}
    assert short_records.durations(config, {"ada_1": EMPTY}) == {"ada_1": 12.0}

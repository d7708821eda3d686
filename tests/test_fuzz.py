"""Every reader of foreign files ends a mutilated file with a result or with one line (more in tests/fuzz.py)."""

import numpy as np
import pytest
from fuzz import READERS, fault, mutilated

N_FILES = 25


@pytest.mark.parametrize("name", READERS)
def test_mutilated_files_are_read_or_rejected_in_one_line(tmp_path, name):
    reader = READERS[name]
    path = tmp_path / f"a{reader.suffix}"
    reader.write(path)
    reader.read(path)
    content, rng = path.read_bytes(), np.random.default_rng(2012)
    faults = []
    for _ in range(N_FILES):
        path.write_bytes(mutilated(content, rng))
        if found := fault(reader, path):
            faults.append(found)
    assert faults == []

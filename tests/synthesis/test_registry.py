"""Systems are found by what their modules declare, in an order that tables can follow, and without being imported."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import cospeech.synthesis
from cospeech.synthesis import System, systems

FOLDER = Path(cospeech.synthesis.__file__).parent
PROMISED = (
    *("hsmm", "hsmm_weighted", "hsmm_sampled"),
    *("random", "prior", "shuffled", "shifted", "clock", "majority", "another", "oracle"),
)


def test_every_promised_system_is_there_and_the_oracle_only_in_the_studio():
    assert set(PROMISED) <= set(systems(studio=True))
    assert set(systems(studio=True)) - set(systems(studio=False)) == {"oracle"}


def test_systems_come_first_then_controls_then_ceilings():
    found = systems(studio=True)
    assert [name for name, system in found.items() if system.role == "system"] == list(PROMISED[:3])
    roles = [system.role for system in found.values()]
    assert roles == sorted(roles, key=["system", "control", "ceiling"].index)
    assert all(name == system.name for name, system in found.items())
    assert len({system.title for system in found.values()}) == len(found)


def test_each_system_has_its_controls_under_wrong_speech():
    found = systems(studio=True)
    assert found["hsmm"].controls == ("shuffled", "shifted")
    for system in list(found.values()):
        if system.role == "system":
            for name, drive in zip(system.controls, ("shuffled", "shifted"), strict=True):
                assert found[name].decoder == system.name
                assert found[name].drive == drive
                assert found[name].role == "control"


@pytest.mark.parametrize("path", sorted(FOLDER.glob("[a-z]*.py")), ids=lambda path: path.stem)
def test_what_is_read_off_a_module_is_what_it_declares(path):
    module = importlib.import_module(f"cospeech.synthesis.{path.stem}")
    declared = getattr(module, "SYSTEM", None)
    assert declared is None or systems(studio=True)[declared.name] == declared


def test_listing_the_systems_loads_nothing_heavy():
    code = (
        "import sys; from cospeech.synthesis import systems; systems(studio=True); "
        "print(sorted({'numba', 'numpy', 'pandas', 'pyarrow'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_new_system_brings_its_controls_along():
    system = System(name="controller", title="Gesture controller", role="system", order=40)
    controls = system.under_wrong_speech()
    assert [control.name for control in controls] == ["controller_shuffled", "controller_shifted"]
    assert {control.decoder for control in controls} == {"controller"}
    assert all(control.controls == () for control in controls)

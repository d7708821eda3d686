"""Installed systems are found by their declarations, in the order of the tables, without loading what they need."""

import subprocess
import sys
from importlib.metadata import entry_points

import pytest
from one_fold import names_of

from cospeech.errors import UserError
from cospeech.synthesis.declaration import ROLES
from cospeech.synthesis.registry import installed, registered, settings_of
from cospeech.workflow import config

PROMISED = (
    *("hsmm", "hsmm_weighted", "hsmm_sampled"),
    *("random", "prior", "shuffled", "shifted", "clock", "majority", "another", "oracle"),
)
ALL = config.defaults()["synthesis"]["systems"]

DECLARED = """
from cospeech.synthesis.declaration import System

def declare(name, **changed):
    return System(**{{"name": name, "title": f"Title of {{name}}", "method": "nowhere"}} | changed)

SYSTEM = {value}
"""


def package_of(value):
    """The text of a module that declares ``value``."""
    return DECLARED.format(value=value)


# ---------------------------------------------------------------- the systems of cospeech


def test_every_promised_system_is_there_and_the_oracle_in_the_studio_only():
    assert set(PROMISED) <= set(registered(ALL, virtual=True).systems)
    real = registered(ALL, virtual=False).systems
    assert set(registered(ALL, virtual=True).systems) - set(real) == {"oracle"}


def test_the_default_configuration_names_every_system_of_cospeech_but_those_of_one_paper():
    left_out = {name for name in names_of("cospeech") if installed(name).makes != "head"} - set(ALL)
    controls = {f"bodylanguage_{control}" for control in ("random", "synchronised", "unsynchronised")}
    assert left_out == controls | {"controller_offline"}
    assert set(ALL) <= set(names_of("cospeech"))


def test_systems_come_first_then_controls_then_ceilings():
    found = registered(ALL, virtual=True).systems
    systems = [name for name, system in found.items() if system.role == "system"]
    assert systems[:3] == list(PROMISED[:3])
    roles = [system.role for system in found.values()]
    assert roles == sorted(roles, key=ROLES.index)
    assert all(name == system.name for name, system in found.items())
    assert len({system.title for system in found.values()}) == len(found)


def test_each_system_is_followed_by_its_controls_on_the_wrong_speech():
    found = registered(ALL, virtual=True).systems
    assert found["hsmm"].controls == ("shuffled", "shifted")
    for system in list(found.values()):
        if system.role == "system":
            for name, drive in zip(system.controls, ("shuffled", "shifted"), strict=True):
                assert found[name].decoder == system.name
                assert found[name].drive == drive
                assert found[name].role == "control"


def test_the_order_of_the_configuration_does_not_matter():
    backwards = dict(reversed(ALL.items()))
    assert list(registered(backwards, virtual=True).systems) == list(registered(ALL, virtual=True).systems)


def test_false_leaves_a_system_out_together_with_its_controls():
    found = registered(ALL | {"hsmm": False, "clock": False}, virtual=True).systems
    assert not {"hsmm", "shuffled", "shifted", "clock"} & set(found)
    assert {"hsmm_weighted", "hsmm_weighted_shifted", "prior"} <= set(found)


@pytest.mark.parametrize("name", names_of("cospeech"))
def test_a_system_is_found_by_its_name_and_so_are_its_controls(name):
    system = installed(name)
    assert system == registered({name: {}}, virtual=True).systems[name]
    for control in system.matched_controls():
        assert installed(control.name) == control


def test_declaring_and_listing_the_systems_loads_nothing_heavy():
    code = (
        "import sys; from cospeech.synthesis.registry import registered, installed; "
        "registered({'hsmm': {}, 'oracle': {}, 'another': {}}, virtual=True); installed('random'); "
        "print(sorted({'numba', 'numpy', 'pandas', 'pyarrow', 'scipy'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# ---------------------------------------------------------------- unknown names and settings


def test_an_unknown_name_gets_a_suggestion():
    with pytest.raises(
        UserError, match=r"config: synthesis\.systems: .*'hsmm_wieghted'; did you mean 'hsmm_weighted'"
    ):
        registered({"hsmm_wieghted": {}}, virtual=True)
    with pytest.raises(UserError, match="no installed package has a system 'xyz'; installed are another, "):
        registered({"xyz": {}}, virtual=True)
    with pytest.raises(UserError, match="'shiftet'; did you mean 'shifted'"):
        installed("shiftet")
    assert registered({"hsmm": {}, "xyz": False}, virtual=True).failures == []


SETTINGS = {"depth": 3, "share": 0.5, "exact": True, "mode": "fast", "steps": [1, 2]}


@pytest.fixture
def adjustable(packages):
    packages.install("adjustable", package_of(f"declare('adjustable', settings={SETTINGS})"))
    return installed("adjustable")


def test_settings_are_laid_over_the_defaults(adjustable):
    assert settings_of(adjustable, {}) == settings_of(adjustable, None) == settings_of(adjustable, True) == SETTINGS
    changed = settings_of(adjustable, {"depth": 4, "share": 1, "steps": []})
    assert changed == SETTINGS | {"depth": 4, "share": 1, "steps": []}
    assert adjustable.settings == SETTINGS


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"dept": 3}, "unknown setting 'dept'; known are depth, share, exact, mode, steps"),
        ({"depth": 3.5}, r"systems\.adjustable\.depth: 3\.5 is of type float; expected int, as the default 3"),
        ({"depth": True}, r"depth: True is of type bool; expected int"),
        ({"share": "half"}, r"share: 'half' is of type str; expected float"),
        ({"share": True}, r"share: True is of type bool; expected float"),
        ({"exact": 1}, r"exact: 1 is of type int; expected bool"),
        ({"mode": None}, r"mode: None is of type NoneType; expected str"),
        ({"steps": 3}, r"steps: 3 is of type int; expected list"),
    ],
)
def test_a_wrong_setting_is_named(adjustable, given, message):
    with pytest.raises(UserError, match=message):
        registered({"adjustable": given}, virtual=True)


def test_a_system_without_settings_says_so():
    with pytest.raises(UserError, match=r"systems\.hsmm: unknown setting 'floor'; it has no settings"):
        registered({"hsmm": {"floor": 1}}, virtual=True)


# ---------------------------------------------------------------- systems of other packages


def test_a_system_of_another_package_is_listed_with_its_controls_and_its_origin(packages):
    packages.install_toy()
    found = registered(ALL | {"toy_lift": {}, "toy_habits": {"shortest_s": 1}}, virtual=True)
    systems = [name for name, system in found.systems.items() if system.role == "system"]
    assert systems[:3] == list(PROMISED[:3])
    assert systems[-2:] == ["toy_habits", "toy_lift"]
    assert found.origins == {"toy_habits": "toy-gestures", "toy_lift": "toy-gestures"}
    assert found.failures == []
    apart = {name for name in found.systems if found.apart(name)}
    assert apart == {f"{toy}{drive}" for toy in found.origins for drive in ("", "_shuffled", "_shifted")}
    assert installed("toy_lift_shifted").drive == "shifted"


def test_a_package_that_is_not_chosen_changes_nothing(packages):
    before = registered(ALL, virtual=True)
    packages.install_toy()
    packages.install("broken", "raise ImportError('no such library')")
    assert registered(ALL, virtual=True) == before


def test_a_system_is_left_out_where_the_records_lack_what_it_needs(packages):
    """The default configuration names all systems, and has to work with gestures without motion, or without sound."""
    packages.install_toy()
    packages.install("counts", package_of("declare('counts', needs=('syllables',))"))
    chosen = ALL | {"toy_lift": {}, "counts": {}}
    found = registered(chosen, True, {"gestures", "prosody"})
    everything = registered(ALL, virtual=True).systems
    assert found.systems == {name: system for name, system in everything.items() if system.makes == "phrases"}
    assert {failure.system: failure.message for failure in found.left_out}.items() >= {
        "counts": "system 'counts' is left out: the records bring no sound in which to find syllables",
        "toy_lift": "system 'toy_lift' is left out: the records bring gesture phrases without motion",
    }.items()
    assert registered(chosen, virtual=True).left_out == []
    assert set(registered(chosen, True, {"motion"}).systems) & {"toy_lift", "counts"} == {"toy_lift"}


BROKEN = {
    "import_error": ("import a_library_that_is_missing", "ModuleNotFoundError: No module named 'a_library_"),
    "exit": ("raise SystemExit(3)", "SystemExit: 3"),
    "several_lines": ("raise ValueError('one\\n two')", "ValueError: one two"),
    "no_value": ("", "AttributeError: .*'SYSTEM'"),
    "nonsense_role": (package_of("declare('nonsense_role', role='genius')"), "declares role 'genius'; known are"),
    "nonsense_need": (package_of("declare('x', needs=('smell',))"), "declares that it needs 'smell'; known are"),
    "no_system": (package_of("'a string'"), "no_system:SYSTEM is of type str, not System; see CONTRIBUTING"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_system_that_cannot_be_loaded_is_named_and_the_others_run(packages, name):
    text, reason = BROKEN[name]
    packages.install(name, text)
    found = registered(ALL | {name: {}}, virtual=True)
    assert found.systems == registered(ALL, virtual=True).systems
    (failure,) = found.failures
    assert failure.system == name
    assert failure.message.startswith(f"system '{name}' of package '{name}' cannot be loaded: ")
    assert "\n" not in failure.message
    with pytest.raises(UserError, match=reason):
        raise UserError(failure.message)
    with pytest.raises(UserError, match=f"system '{name}' of package '{name}' cannot be loaded: "):
        installed(name)
    assert {name, f"{name}_shuffled", f"{name}_shifted"} == found.failed()


def test_a_system_may_have_another_name_than_the_entry_point_that_cannot_be_loaded(packages):
    packages.install("broken", "raise ImportError('no such library')", entry="gestures")
    found = registered(ALL | {"clever": {}}, virtual=True)
    (failure,) = found.failures
    assert failure.system == "clever"
    assert failure.message == (
        "no package that can be loaded has a system 'clever'; package 'broken' may have it, but its 'gestures' "
        "cannot be loaded: ImportError: no such library"
    )


def test_a_package_cannot_take_the_name_of_a_system_of_cospeech(packages):
    packages.install("aaa", package_of("declare('hsmm', title='Mine')"))
    found = registered(ALL, virtual=True)
    assert found.systems == registered(ALL, virtual=True).systems
    assert found.systems["hsmm"].method.startswith("cospeech.")
    assert installed("hsmm").method.startswith("cospeech.")
    assert [failure.message for failure in found.failures] == [
        "system 'hsmm' of package 'aaa' is left out: package 'cospeech' has a system 'hsmm'; rename one of them"
    ]
    assert found.origins == {}


@pytest.mark.parametrize("chosen", [ALL, {"clock": {}}])
def test_nor_that_of_a_control(packages, chosen):
    packages.install("mine", package_of("declare('mine', controls=('mixed', 'shifted'))"))
    found = registered(chosen | {"mine": {}}, virtual=True)
    assert list(found.systems) == list(registered(chosen, virtual=True).systems)
    (failure,) = found.failures
    assert failure.system == "mine"
    assert "package 'cospeech' has a system 'shifted'" in failure.message
    assert installed("shifted").decoder == "hsmm"


def test_of_two_packages_with_one_name_the_first_has_it(packages):
    packages.install("second", package_of("declare('twin')"))
    packages.install("first", package_of("declare('twin')"))
    found = registered({"twin": {}}, virtual=True)
    assert found.origins == {"twin": "first"}
    (failure,) = found.failures
    assert failure.message.startswith("system 'twin' of package 'second' is left out: package 'first' has")


def test_the_entry_points_are_those_of_the_installed_metadata():
    assert {entry.name for entry in entry_points(group="cospeech.systems")} >= {"controls", "hsmm"}

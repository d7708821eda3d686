"""The systems that are installed: entry points of the group ``cospeech.systems``.

An entry point names a ``System`` or a tuple of them. A package of its own can thus add a system: once installed, it
is named in the configuration (``synthesis.systems``) like any other.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from importlib.metadata import EntryPoint, entry_points
from typing import Any, NamedTuple

from cospeech.errors import UserError
from cospeech.synthesis.declaration import ROLES, System

GROUP = "cospeech.systems"
HOME = "cospeech"


class Failure(NamedTuple):
    """A system that cannot run, and why, in one line."""

    system: str
    message: str


class Registered(NamedTuple):
    """The systems of a run by name (systems, their controls and the others, ceilings), and those that failed.

    ``origins`` names the package that brought a system, for systems that cospeech does not bring itself.
    """

    systems: dict[str, System]
    origins: dict[str, str]
    failures: list[Failure]

    def apart(self, name: str) -> bool:
        """Return whether a system comes from another package, and so runs in a process of its own."""
        return self.systems[name].decoder in self.origins


def registered(chosen: Mapping[str, Any], virtual: bool) -> Registered:
    """Return the systems that a configuration chooses.

    Parameters
    ----------
    chosen : ``synthesis.systems`` of the configuration: name of a system to its settings, or False to leave it out.
    virtual : whether the corpus has a planted truth.

    Raises
    ------
    UserError : where no installed package has a system of that name, or a setting is unknown.
    """
    names = {name for name, settings in chosen.items() if settings is not False}
    found: dict[str, System] = {}
    origins: dict[str, str] = {}
    failures: list[Failure] = []
    entries = sorted(entry_points(group=GROUP), key=lambda entry: (_package(entry) != HOME, entry.name))
    for entry in entries:
        package = _package(entry)
        try:
            declared = _declared(entry)
        except Exception as error:  # whatever another package raises is its own failure, and not the run's
            if entry.name in names:
                failures.append(
                    Failure(entry.name, f"system '{entry.name}' of package '{package}': {_reason(error)}")
                )
            continue
        for system in declared:
            if system.name not in names or ("truth" in system.needs and not virtual):
                continue
            if system.name in found:
                message = f"system '{system.name}' of package '{package}': the name is taken; rename the system"
                failures.append(Failure(f"{system.name} of {package}", message))
                continue
            found[system.name] = system
            if package != HOME:
                origins[system.name] = package
    missing = sorted(names - found.keys() - {failure.system for failure in failures})
    known = {name for entry in entries for name in _names(entry)} if missing else set()
    for name in missing:
        if name not in known:
            raise UserError(f"config: synthesis.systems: {_unknown(name, sorted(known))}")
    for name, system in found.items():
        settings_of(system, chosen[name])
    ordered = sorted(found.values(), key=lambda system: (ROLES.index(system.role), system.order, system.name))
    hearing = [system for system in ordered if system.role == "system"]
    controls = [control for system in hearing for control in system.under_wrong_speech()]
    rest = [system for system in ordered if system.role != "system"]
    return Registered({system.name: system for system in hearing + controls + rest}, origins, failures)


def installed(name: str) -> System:
    """Return the system ``name``, or the control ``name`` of a system, from whatever package brings it.

    Raises
    ------
    UserError : where no installed package has it, or its package fails to load.
    """
    known = []
    for entry in entry_points(group=GROUP):
        try:
            declared = _declared(entry)
        except Exception as error:
            if entry.name == name:
                raise UserError(f"system '{name}' of package '{_package(entry)}': {_reason(error)}") from error
            continue
        for system in declared:
            for one in (system, *system.under_wrong_speech()):
                if one.name == name:
                    return one
                known.append(one.name)
    raise UserError(_unknown(name, known))


def settings_of(system: System, given: Mapping[str, Any] | bool | None) -> dict[str, Any]:
    """Return the settings of a system: its defaults, with those ``given`` in the configuration laid over them.

    Raises
    ------
    UserError : an unknown setting, or one of another type than its default.
    """
    own = dict(given) if isinstance(given, Mapping) else {}
    for key, value in own.items():
        if key not in system.settings:
            hint = f"known are {', '.join(system.settings)}" if system.settings else "it has no settings"
            raise UserError(f"config: synthesis.systems.{system.decoder}: unknown setting '{key}'; {hint}")
        default = system.settings[key]
        numbers = isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool)
        if not numbers and type(value) is not type(default):
            raise UserError(
                f"config: synthesis.systems.{system.decoder}.{key}: {value!r} is of type {type(value).__name__}; "
                f"expected {type(default).__name__}, as the default {default!r}"
            )
    return {**system.settings, **own}


def _package(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist is not None else entry.module.split(".")[0]


def _declared(entry: EntryPoint) -> tuple[System, ...]:
    value = entry.load()
    declared = value if isinstance(value, tuple) else (value,)
    for system in declared:
        if not isinstance(system, System):
            raise TypeError(
                f"{entry.value} is {type(system).__name__}, not a System; see CONTRIBUTING, 'A new system'"
            )
    return declared


def _names(entry: EntryPoint) -> list[str]:
    """Return the names that an entry point stands for; its own where it does not load."""
    try:
        return [entry.name, *(system.name for system in _declared(entry))]
    except Exception:
        return [entry.name]


def _reason(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())


def _unknown(name: str, known: list[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"did you mean '{near[0]}'?" if near else f"installed are {', '.join(known)}"
    return f"no installed package has a system '{name}'; {hint}"

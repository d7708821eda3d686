"""The systems that are installed: entry points of the group ``cospeech.systems``.

An entry point names a ``System`` or a tuple of them. A third-party package can add a system in this way: once the
package is installed, the system is named in the configuration (``synthesis.systems``) like any other.
"""

from __future__ import annotations

import difflib
import functools
import sys
from collections.abc import Collection, Iterator, Mapping
from importlib.metadata import EntryPoint, entry_points
from typing import Any, NamedTuple

from cospeech.errors import UserError
from cospeech.synthesis.declaration import ROLES, WRONG_SPEECH, DeclarationError, System

GROUP = "cospeech.systems"
HOME = "cospeech"
OFFERED = frozenset({"motion", "syllables", "head", "melody"})
"""What records can bring that systems need, and that other records lack."""


class Failure(NamedTuple):
    """A system that cannot run, and why, in one line."""

    system: str
    message: str


class Registered(NamedTuple):
    """The systems of a run.

    Attributes
    ----------
    systems : by name; systems first, then their matched controls, other controls and ceilings.
    origins : the package of each system that is not part of cospeech.
    failures : the systems that could not be loaded.
    left_out : the systems that need what the records do not bring.
    """

    systems: dict[str, System]
    origins: dict[str, str]
    failures: list[Failure]
    left_out: list[Failure]

    def apart(self, name: str) -> bool:
        """Return whether a system belongs to another package, and therefore runs in a process of its own."""
        return self.systems[name].decoder in self.origins

    def messages(self) -> list[str]:
        """Return one line for each system that cannot run, or for several that lack the same."""
        groups: dict[str, list[str]] = {}
        for failure in self.left_out:
            groups.setdefault(failure.message.removeprefix(f"system '{failure.system}' is left out: "), []).append(
                failure.system
            )
        lines = [failure.message for failure in self.failures]
        for reason, names in groups.items():
            listed = f"system '{names[0]}' is" if len(names) == 1 else f"systems {', '.join(map(repr, names))} are"
            lines.append(f"{listed} left out: {reason}")
        return lines

    def failed(self) -> set[str]:
        """Return the names that the systems which could not be loaded, and their matched controls, would have had."""
        names = {failure.system for failure in self.failures}
        return names | {f"{name}_{drive}" for name in names for drive in WRONG_SPEECH}


class _Loaded(NamedTuple):
    """What an entry point declares, or why it cannot be loaded."""

    name: str
    package: str
    systems: tuple[System, ...]
    error: str | None


def registered(chosen: Mapping[str, Any], virtual: bool, offered: Collection[str] = OFFERED) -> Registered:
    """Return the systems that a configuration chooses.

    A system of another package that cannot be loaded is among the failures, and the others run without it.

    Parameters
    ----------
    chosen : ``synthesis.systems`` of the configuration: settings of each system by name, or False to leave it out.
    virtual : whether the corpus has a planted truth. Systems that need it are left out where there is none.
    offered : what the records bring. Systems that need something else are left out, too.

    Raises
    ------
    UserError : if no installed package has a system of that name, or a setting is unknown.
    """
    names = {name for name, settings in chosen.items() if settings is not False}
    found: dict[str, System] = {}
    origins: dict[str, str] = {}
    failures: dict[str, str] = {}
    owners: dict[str, str] = {}
    known: list[str] = []
    broken: list[_Loaded] = []
    for loaded in _loaded():
        known += [loaded.name, *(system.name for system in loaded.systems)]
        if loaded.error:
            broken.append(loaded)
        for system in loaded.systems:
            own = (system.name, *system.controls)
            clash = next((name for name in own if name in owners), None)
            if clash is None:
                owners |= dict.fromkeys(own, loaded.package)
            if system.name not in names:
                continue
            if clash is not None:
                key = f"{system.name} ({loaded.package})" if system.name in found else system.name
                failures[key] = (
                    f"system '{system.name}' of package '{loaded.package}' is left out: package '{owners[clash]}' "
                    f"has a system '{clash}'; rename one of them"
                )
                continue
            found[system.name] = system
            if loaded.package != HOME:
                origins[system.name] = loaded.package
    for name in sorted(names - found.keys() - failures.keys()):
        if not broken:
            raise UserError(f"config: synthesis.systems: {_unknown(name, sorted(set(known)))}")
        failures[name] = _cannot_load(name, broken)
    for name, system in found.items():
        settings_of(system, chosen[name])
    possible = [system for system in found.values() if virtual or "truth" not in system.needs]
    missing = {system.name: lack for system in possible if (lack := _lack(system, offered))}
    usable = [system for system in possible if system.name not in missing]
    ordered = sorted(
        usable, key=lambda system: (ROLES.index(system.role), system.name in origins, system.order, system.name)
    )
    driven = [system for system in ordered if system.role == "system"]
    controls = [control for system in driven for control in system.matched_controls()]
    rest = [system for system in ordered if system.role != "system"]
    return Registered(
        {system.name: system for system in driven + controls + rest},
        origins,
        [Failure(name, message) for name, message in failures.items()],
        [Failure(name, message) for name, message in missing.items()],
    )


def _lack(system: System, offered: Collection[str]) -> str | None:
    """Return why a system cannot run on records that bring only what is ``offered``, or None."""
    if system.makes == "head":
        lacking = sorted({"head", "melody"} - set(offered))
        brought = {"head": "no head", "melody": "neither sound nor melody"}
        return f"system '{system.name}' is left out: the records bring {brought[lacking[0]]}" if lacking else None
    if not {"motion", "gestures"} & set(offered):
        return f"system '{system.name}' is left out: the records bring a head and no body"
    body = {"motion", "phases", "subunits"} & set(system.needs) or system.makes == "motion"
    if body and "motion" not in offered:
        return f"system '{system.name}' is left out: the records bring gesture phrases without motion"
    if "syllables" in system.needs and "syllables" not in offered:
        return f"system '{system.name}' is left out: the records bring no sound in which to find syllables"
    return None


def installed(name: str) -> System:
    """Return the system ``name``, or the matched control ``name`` of a system, from whatever package has it.

    Raises
    ------
    UserError : if no installed package has it, or its package cannot be loaded.
    """
    known: list[str] = []
    broken: list[_Loaded] = []
    for loaded in _loaded():
        if loaded.error:
            broken.append(loaded)
        for system in loaded.systems:
            for one in (system, *system.matched_controls()):
                if one.name == name:
                    return one
                known.append(one.name)
    raise UserError(_cannot_load(name, broken) if broken else _unknown(name, known))


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


def _loaded() -> Iterator[_Loaded]:
    """Yield the entry points, those of cospeech first: no other package can take the names of its systems."""
    for package, entry in _entries(tuple(sys.path)):
        try:
            yield _Loaded(entry.name, package, _declared(entry), None)
        except (Exception, SystemExit) as error:  # whatever another package raises must not stop the run
            if package == HOME:
                raise
            reason = str(error) if isinstance(error, DeclarationError) else f"{type(error).__name__}: {error}"
            yield _Loaded(entry.name, package, (), " ".join(reason.split()))


@functools.cache
def _entries(_path: tuple[str, ...]) -> list[tuple[str, EntryPoint]]:
    """Return the packages and entry points on a search path; the metadata of all packages are read for it."""
    entries = [(_package(entry), entry) for entry in entry_points(group=GROUP)]
    return sorted(entries, key=lambda pair: (pair[0] != HOME, pair[1].name, pair[0]))


def _package(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist is not None else entry.module.split(".")[0]


def _declared(entry: EntryPoint) -> tuple[System, ...]:
    value = entry.load()
    declared = value if isinstance(value, tuple) else (value,)
    for system in declared:
        if not isinstance(system, System):
            raise DeclarationError(
                f"{entry.value} is of type {type(system).__name__}, not System; see CONTRIBUTING, 'A new system'"
            )
    return declared


def _cannot_load(name: str, broken: list[_Loaded]) -> str:
    """Return the message for a system that is missing while packages cannot be loaded, of which one may have it."""
    for one in broken:
        if one.name == name:
            return f"system '{name}' of package '{one.package}' cannot be loaded: {one.error}"
    first = broken[0]
    return (
        f"no package that can be loaded has a system '{name}'; package '{first.package}' may have it, but its "
        f"'{first.name}' cannot be loaded: {first.error}"
    )


def _unknown(name: str, known: list[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"did you mean '{near[0]}'?" if near else f"installed are {', '.join(known)}"
    return f"no installed package has a system '{name}'; {hint}"

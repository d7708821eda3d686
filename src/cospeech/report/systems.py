"""The systems of a run, as the report knows them: by role, order and matched controls, never by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

Role = Literal["system", "control", "ceiling"]


@dataclass(frozen=True)
class System:
    """One system, control or ceiling.

    Attributes
    ----------
    name : as in paths and tables.
    title : as a reader sees it.
    role : a ``system`` is driven by the record's own speech; a ``control`` is not, or by the wrong speech; a
        ``ceiling`` knows what no system may know.
    controls : its matched controls, which are the same system driven by the wrong speech; the strictest one last.
    variant : its main variant.
    swept : whether it was run at every setting of the sweep.
    plans : whether it plans gesture phrases; the others only make motion, in which phrases are seen.
    origin : the third-party package that brought it, or None.
    source : where its method is described.
    """

    name: str
    title: str
    role: Role
    controls: Sequence[str] = ()
    variant: str = "main"
    swept: bool = False
    plans: bool = True
    origin: str | None = None
    source: str = ""

    @property
    def phrases_file(self) -> str:
        """The file of its phrases: planned ones, or those seen in its motion where it plans none."""
        return "phrases.parquet" if self.plans else "phrases_seen.parquet"


Systems = dict[str, System]
"""By name, in the order of every table."""


def from_params(params: Mapping[str, Mapping[str, Any]]) -> Systems:
    """Return the systems that a rule hands to its script as plain mappings."""
    return {name: System(**{"name": name, **given}) for name, given in params.items()}


def driven(systems: Systems) -> list[System]:
    """Return those that are driven by the record's own speech."""
    return [system for system in systems.values() if system.role == "system"]


def matched(systems: Systems) -> set[str]:
    """Return the names of all matched controls."""
    return {control for system in systems.values() for control in system.controls}


def general_controls(systems: Systems) -> list[System]:
    """Return the controls that belong to no system in particular."""
    own = matched(systems)
    return [system for system in systems.values() if system.role == "control" and system.name not in own]


def first_ceiling(systems: Systems) -> System | None:
    """Return the ceiling of planned phrases: the first one, or None where there is none."""
    return next((system for system in systems.values() if system.role == "ceiling" and system.plans), None)


def pictured(systems: Systems, shown: Sequence[str]) -> list[str]:
    """Return the systems that figures show: the first one, and those of the videos."""
    return list(dict.fromkeys([*(system.name for system in driven(systems)[:1]), *shown]))


def in_timeline(systems: Systems, shown: Sequence[str]) -> list[str]:
    """Return the systems that are shown for a single record: those that figures show, and two controls.

    They are the strictest control of the first system in the videos, and the first control that belongs to no system.
    """
    strictest = systems[shown[0]].controls[-1:]
    general = [control.name for control in general_controls(systems)[:1]]
    return list(dict.fromkeys([*pictured(systems, shown), *strictest, *general]))

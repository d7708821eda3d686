"""The settings of the prosody clusters: the main one, and those of the sweep."""

from __future__ import annotations

from typing import NamedTuple

from cospeech.workflow.config import Config


class Setting(NamedTuple):
    """One setting of the prosody clusters: number of branches M and of states N."""

    clusters: int
    states: int

    @property
    def path(self) -> str:
        """The part of an artifact's path that names the setting."""
        return f"clusters~{self.clusters}/states~{self.states}"

    @property
    def variant(self) -> str:
        """The variant, at this setting, of a system that listens to prosody clusters."""
        return f"clusters~{self.clusters},states~{self.states}"


def main_setting(config: Config) -> Setting:
    """Return the setting that every system runs at."""
    prosody = config["phrases"]["prosody"]
    return Setting(prosody["clusters"], prosody["states"])


def sweep_settings(config: Config) -> list[Setting]:
    """Return the further settings of the sweep, without the main one.

    ``lines`` are the two of fig. 7.2 through the main setting (clusters at its states, states at its clusters);
    ``full`` is every pair.
    """
    sweep, main = config["sweep"], main_setting(config)
    if sweep["grid"] == "full":
        settings = [Setting(clusters, states) for clusters in sweep["clusters"] for states in sweep["states"]]
    else:
        settings = [Setting(clusters, main.states) for clusters in sweep["clusters"]]
        settings += [Setting(main.clusters, states) for states in sweep["states"]]
    return [setting for setting in dict.fromkeys(settings) if setting != main]

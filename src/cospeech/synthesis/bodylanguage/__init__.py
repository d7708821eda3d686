"""Body language from the prosody of syllables (Levine 2009), and the controls of its surveys and its pilot study.

All share a model and differ in how they select the next subunit.
"""

from typing import Any

from cospeech.synthesis.declaration import System

TABLES = {
    "subunits": "subunit_library",
    "clusters": "subunit_clusters",
    "successors": "subunit_successors",
    "observations": "subunit_observations",
    "settings": "bodylanguage_settings",
    "speech": "syllable_statistics",
}
"""The tables of a model, with their schemas."""

REPORTS = {
    "decisions": "subunit_decisions",
    "occurrences": "observation_occurrences",
    "selections": "subunit_selections",
    "elapsed": "elapsed_errors",
}
"""Tables about the synthesis of a record (see ``report``), with their schemas."""


def _declare(name: str, title: str, method: str, source: str, order: int, **more: Any) -> System:
    return System(
        name=name,
        title=title,
        method=f"cospeech.synthesis.bodylanguage.{method}",
        source=f"Levine 2009, {source}",
        needs=("syllables", "subunits", "motion"),
        makes="motion",
        tables=TABLES,
        settings={"elapsed": "exact", "pose_tolerance_deg": 5.0, "blending": "velocity"},
        order=order,
        live=True,
        **more,
    )


SYSTEMS = (
    _declare("bodylanguage", "Body language", "proposed", "chapters 2 to 5", 60, reports=REPORTS),
    _declare(
        "bodylanguage_random",
        "Random subunits",
        "random_selection",
        "6.1",
        60,
        role="control",
        shares="bodylanguage",
    ),
    _declare(
        "bodylanguage_synchronised",
        "Random subunits at syllables",
        "random_synchronised",
        "7.1",
        61,
        role="control",
        shares="bodylanguage",
    ),
    _declare(
        "bodylanguage_unsynchronised",
        "Body language without synchrony",
        "unsynchronised",
        "7.1",
        62,
        role="control",
        shares="bodylanguage",
    ),
)

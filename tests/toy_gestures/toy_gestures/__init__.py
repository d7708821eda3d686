"""Two toy systems: one plans gesture phrases from prosody labels, the other raises the hands with the intensity."""

from cospeech.synthesis.declaration import System

SYSTEMS = (
    System(
        name="toy_habits",
        title="Toy: habits",
        method="toy_gestures.habits",
        needs=("gestures", "prosody_labels"),
        makes="phrases",
        tables={"habits": "habits", "timing": "timing"},
        schemas="toy_gestures",
        settings={"shortest_s": 0.5},
    ),
    System(
        name="toy_lift",
        title="Toy: lifted hands",
        method="toy_gestures.lift",
        needs=("prosody",),
        makes="motion",
        tables={"lift": "lift"},
        schemas="toy_gestures",
        settings={"highest_deg": 70.0},
        live=True,
    ),
)

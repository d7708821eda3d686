"""Controls and ceilings without a model of speech: what a system has to beat, and the best that it can reach."""

from cospeech.synthesis.declaration import DRAWS, System

SYSTEMS = (
    System(
        name="random",
        title="Random phrases",
        method="cospeech.synthesis.controls.random_phrases",
        source="Özkul 2012, 7.2",
        role="control",
        needs=("gestures",),
        tables={"pool": "segments"},
        order=10,
        draws=DRAWS,
    ),
    System(
        name="clock",
        title="Clock",
        method="cospeech.synthesis.controls.clock",
        role="control",
        needs=("gestures",),
        tables={"pool": "segments"},
        order=30,
    ),
    System(
        name="majority",
        title="Most frequent label",
        method="cospeech.synthesis.controls.majority",
        role="control",
        needs=("gestures",),
        tables={"pool": "segments"},
        order=40,
    ),
    System(
        name="another",
        title="Another real record",
        method="cospeech.synthesis.controls.another",
        role="ceiling",
        needs=("gestures",),
        tables={"pool": "segments", "order": "record_order"},
        order=10,
    ),
)

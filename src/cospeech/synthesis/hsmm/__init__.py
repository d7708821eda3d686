"""The hidden semi-Markov model of Özkul 2012, chapter 5: as printed, weighted, sampled, without speech, and planted.

All but the planted one share a model and differ in how they decode it.
"""

from cospeech.synthesis.declaration import System

THESIS = "Özkul 2012, chapter 5"
TABLES = {name: name for name in ("initial", "transitions", "emissions", "durations", "decoder")}

SYSTEMS = (
    System(
        name="hsmm",
        title="HSMM as printed",
        method="cospeech.synthesis.hsmm.printed",
        source=THESIS,
        tables=TABLES,
        order=10,
        controls=("shuffled", "shifted"),
        swept=True,
    ),
    System(
        name="hsmm_weighted",
        title="HSMM, emissions weighted",
        method="cospeech.synthesis.hsmm.weighted",
        source=f"{THESIS}, with the stream exponents of Sargin 2006, eq. 4.18",
        shares="hsmm",
        tables=TABLES,
        order=20,
        swept=True,
    ),
    System(
        name="hsmm_sampled",
        title="HSMM, drawn from the posterior",
        method="cospeech.synthesis.hsmm.sampled",
        source=THESIS,
        shares="hsmm",
        tables=TABLES,
        order=30,
    ),
    System(
        name="prior",
        title="HSMM without its emissions",
        method="cospeech.synthesis.hsmm.prior",
        source=THESIS,
        role="control",
        shares="hsmm",
        tables=TABLES,
        order=20,
    ),
    System(
        name="oracle",
        title="HSMM with the planted parameters",
        method="cospeech.synthesis.hsmm.oracle",
        role="ceiling",
        needs=("gestures", "truth"),
        tables=TABLES,
        order=20,
    ),
)

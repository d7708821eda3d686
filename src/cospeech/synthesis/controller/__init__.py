"""The gesture controller of Levine et al. 2010, which has an inference layer and a control layer.

The inference layer turns prosody into beliefs over the hidden states of gesture kinematics (section 6). The control
layer selects the motion segments that fit the beliefs and follow one another smoothly (section 7, appendix A).
"""

from cospeech.synthesis.declaration import System

SOURCE = "Levine et al. 2010"

INFERENCE = ("scales", "gaussians", "chain", "observations", "states")
CONTROL = ("kinematics", "styles", "policy", "situations", "situation_chain", "convergence", "keywords")

TABLES = {
    "controller": "controller",
    **{name: f"controller_{name}" for name in (*INFERENCE, *CONTROL)},
    **{name: name for name in ("library", "delta", "successors", "interruptions", "body", "poses")},
}

REPORTS = {
    **{name: f"controller_{name}" for name in ("windows", "regret", "control_layer")},
    **{name: name for name in ("beliefs", "decisions")},
}
"""Tables about what the controller does with the speech of a record; the offline controller writes them."""

SETTINGS = {
    "states": [4, 6, 9, 14, 25],
    "clusters": 10,
    "window": 4,
    "unvoiced_hz": [60.0, 500.0],
    "transition_s": 0.1,
    "interruption_s": 0.05,
    "horizon_s": 15.0,
    "repetition_s": 0.05,
    "memory_s": 10.0,
    "situations": 40,
    "discounts": "corrected",
}
"""Settings of the system and their defaults.

states : numbers of hidden states, of which the one with the highest held-out likelihood is chosen; 25 in the paper,
    for 12 minutes of motion.
clusters : clusters of prosody.
window : time steps of the input window; 4 in the paper.
unvoiced_hz : range of the uniformly distributed F0 of unvoiced syllables; that in which pitch is looked for.
transition_s, interruption_s, horizon_s : cost of transitions and interruptions, and the time horizon of the policy
    (see ``control``).
repetition_s, memory_s : cost of showing a segment again, and the time in which it fades; not in the paper.
situations : typical beliefs that the policy plans with; 0: hidden states, as in the paper (see ``situations``).
discounts : corrected or printed (see ``policy``).
"""

SYSTEMS = (
    System(
        name="controller",
        title="Gesture controller",
        method="cospeech.synthesis.controller.online",
        source=f"{SOURCE}, section 7.2",
        needs=("syllables", "phases", "motion"),
        makes="motion",
        tables=TABLES,
        settings=SETTINGS,
        order=40,
        live=True,
    ),
    System(
        name="controller_offline",
        title="Gesture controller, offline",
        method="cospeech.synthesis.controller.whole",
        source=f"{SOURCE}, section 7.1",
        needs=("syllables", "phases", "motion"),
        makes="motion",
        shares="controller",
        tables=TABLES,
        reports=REPORTS,
        settings=SETTINGS,
        order=41,
    ),
)

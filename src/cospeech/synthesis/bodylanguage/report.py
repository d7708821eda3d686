"""What body language does with the speech of a record: the material of the thesis's table 3.1 and figure 5.2."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from cospeech.data.arrays import Floats
from cospeech.synthesis import live
from cospeech.synthesis.bodylanguage import forward, model
from cospeech.synthesis.bodylanguage.chain import Chain
from cospeech.synthesis.bodylanguage.model import SECTIONS, Model
from cospeech.synthesis.bodylanguage.observations import (
    N_OBSERVATIONS,
    PRIOR_SYLLABLES,
    Listener,
    Observed,
    Statistics,
    can_occur,
    features,
)
from cospeech.synthesis.bodylanguage.player import Player
from cospeech.synthesis.interface import Speech, Training

N_SELECTIONS = 40
"""Number of observations in figure 5.2."""


def heard_by(trained: Model, speech: Speech) -> list[Observed]:
    """Return the observations of the speech in the order in which a listener makes them."""
    listener = Listener(Statistics(trained.mean, trained.deviation, PRIOR_SYLLABLES), trained.wait_s)
    found: list[Observed] = []
    for heard in live.frames(speech):
        found += listener.hear((heard.frame + 1) * speech.frame_s, heard.syllables)
    return found


def occurrences(observed: Mapping[str, Sequence[Observed]]) -> pd.DataFrame:
    """Return how often each observation occurs in the training records (table 3.1)."""
    numbers = [one.observation for record in observed.values() for one in record]
    values = np.array([features(number) for number in range(N_OBSERVATIONS)])
    table = pd.DataFrame(values, columns=["up", "down", "intensity", "length"])
    table.insert(0, "observation", np.arange(N_OBSERVATIONS))
    table["can_occur"] = [can_occur(number) for number in range(N_OBSERVATIONS)]
    table["count"] = np.bincount(numbers, minlength=N_OBSERVATIONS)
    return table


def beliefs(chain: Chain, observed: Sequence[Observed], mode: int) -> list[forward.Belief]:
    """Return the forward probabilities after each observation, whatever is shown."""
    n = len(chain.initial)
    last, time_s, found = forward.first(chain.initial, mode), 0.0, []
    nothing_ended = np.zeros(n, dtype=bool)
    following = forward.successors(chain.after_start, chain.after)
    for one in observed:
        new = forward.empty(n, mode)
        forward.update(
            chain.continuing, following, chain.emissions[one.observation], chain.logit, chain.length_s,
            one.known_s - time_s, nothing_ended, mode, last, new,
        )  # fmt: skip
        found.append(new)
        last, time_s = new, one.known_s
    return found


def alphas(found: Sequence[forward.Belief], n_clusters: int) -> Floats:
    """Return the probabilities (T, 2, N) of start and continuation states."""
    return np.array([forward.probabilities(belief) for belief in found]).reshape(len(found), 2, n_clusters)


def selections(chain: Chain, observed: Sequence[Observed]) -> pd.DataFrame:
    """Return the forward probability of each state after each observation, and which states are selected (fig. 5.2).

    There are two sequences of selections: by the largest direct probability, and by the largest product of direct and
    forward probability. Each starts from the most probable initial state, and depends on its own previous selection.
    """
    n = len(chain.initial)
    carried = beliefs(chain, observed, forward.EXACT)
    alpha = alphas(carried, n)
    chosen = {name: _selected(chain, observed, carried, name == "product") for name in ("direct", "product")}
    step, started, cluster = (axis.ravel() for axis in np.indices(alpha.shape))
    state = started * n + cluster
    return pd.DataFrame(
        {
            "step": step,
            "time_s": np.array([one.known_s for one in observed])[step],
            "cluster": cluster,
            "start": started == 0,
            "forward": alpha.ravel(),
            "by_direct": state == chosen["direct"][step],
            "by_product": state == chosen["product"][step],
        }
    )


def _selected(
    chain: Chain, observed: Sequence[Observed], carried: Sequence[forward.Belief], by_product: bool
) -> np.ndarray:
    """Return the selected states (T,): cluster i for s_i, and N + i for c_i."""
    n = len(chain.initial)
    shown, started, begun_s = int(chain.initial.argmax()), True, 0.0
    gamma = np.empty(n + 1)
    states = np.empty(len(observed), dtype=np.int64)
    for t, (one, belief) in enumerate(zip(observed, carried, strict=True)):
        share = (one.known_s - begun_s) / chain.length_s[shown]
        emission = chain.emissions[one.observation]
        forward.direct(
            chain.continuing,
            chain.after_start,
            chain.after,
            emission,
            chain.logit,
            shown,
            started,
            share,
            False,
            gamma,
        )
        if by_product:
            forward.combine(belief, shown, gamma)
        best = int(gamma.argmax())
        started = best < n
        if started:
            shown, begun_s = best, one.known_s
        states[t] = shown + (0 if started else n)
    return states


def elapsed_errors(chains: Mapping[str, Chain], observed: Sequence[Observed]) -> pd.DataFrame:
    """Return how far the forward probabilities with an expected elapsed share are from the exact ones.

    ``variation`` is the total variation distance, half the sum of the absolute differences over all states.
    """
    rows = []
    for section, chain in chains.items():
        n = len(chain.initial)
        exact = beliefs(chain, observed, forward.EXACT)
        true, share = alphas(exact, n), np.array([forward.expected_share(belief) for belief in exact]).reshape(-1, n)
        for mode in (forward.EXPECTED, forward.PRINTED):
            found = beliefs(chain, observed, mode)
            variation = 0.5 * np.abs(alphas(found, n) - true).sum(axis=(1, 2))
            off = np.abs(np.array([belief.elapsed[:, 0] for belief in found]).reshape(-1, n) - share)
            weight = true[:, 1].sum()
            rows.append(
                {
                    "section": section,
                    "mode": forward.MODES[mode],
                    "n": len(observed),
                    "variation_mean": variation.mean() if len(variation) else 0.0,
                    "variation_max": variation.max(initial=0.0),
                    "share_error": (off * true[:, 1]).sum() / weight if weight > 0.0 else 0.0,
                }
            )
    return pd.DataFrame(rows)


def decisions(trained: Model, player: Player, speech: Speech) -> pd.DataFrame:
    """Return the subunits that a player starts, in order of time.

    Parameters
    ----------
    player : the state at the start of the speech.
    """
    own = trained.subunits
    rows = []
    shown = [(-1, -1)] * len(SECTIONS)
    for heard in live.frames(speech):
        made = len(player.hear(heard))
        for s, section in enumerate(SECTIONS):
            segment, n_shown = int(player.memory.segment[s]), int(player.memory.frame[s])
            if made and (segment != shown[s][0] or n_shown <= shown[s][1]):
                frame = player.n_frames - n_shown
                rows.append(
                    {
                        "step": heard.frame,
                        "time_s": (frame + 0.5) / speech.motion_fps,
                        "section": section,
                        "segment": int(own["segment"].iloc[segment]),
                        "record": own["record"].iloc[segment],
                        "cluster": int(own["cluster"].iloc[segment]),
                        "frame": frame,
                        "probability": float(player.memory.probability[s]),
                        "policy": "online",
                    }
                )
            if made:
                shown[s] = segment, n_shown
    return pd.DataFrame(rows)


def report(training: Training, trained: Model, speech: Speech, player: Player) -> dict[str, pd.DataFrame]:
    """Return the reports that the system declares.

    Parameters
    ----------
    player : the state at the start of the speech.
    """
    observed = heard_by(trained, speech)
    parts = [
        selections(chain, observed[:N_SELECTIONS]).assign(section=section)
        for section, chain in trained.chains.items()
    ]
    return {
        "decisions": decisions(trained, player, speech),
        "occurrences": occurrences(model.observe(training)),
        "selections": pd.concat(parts, ignore_index=True),
        "elapsed": elapsed_errors(trained.chains, observed),
    }

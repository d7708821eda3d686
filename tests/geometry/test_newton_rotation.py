"""Newton's method on the orthogonal group, as printed and as corrected, against the closed form."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cospeech.geometry.newton_rotation import Variant, newton_rotation
from cospeech.geometry.rigid import align

FACE_M = (0.05, 0.06, 0.02)
"""Standard deviations of the points of a face, across, upward and forward."""


def planted(draw, degrees, noise_m):
    axis = draw.normal(size=3)
    turn = Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis)).as_matrix()
    source = draw.normal(size=(60, 3)) * FACE_M
    return source, source @ turn.T + draw.normal(size=(60, 3)) * noise_m + draw.normal(size=3)


def found(variant, degrees, noise_m=0.002, n=12):
    """For n random turns by an angle: whether the search ended at the closed form's optimum, and its steps."""
    draw = np.random.default_rng([int(degrees), list(Variant).index(variant)])
    results = []
    for _ in range(n):
        source, target = planted(draw, degrees, noise_m)
        search = newton_rotation(source, target, variant)
        same = np.abs(search.rotation - align(source, target[None])[0][0]).max() < 1e-9
        results.append((same, search.n_steps, search.converged))
    return np.array(results).T


@pytest.mark.parametrize("variant", list(Variant))
@pytest.mark.parametrize("degrees", [1, 10, 30, 60, 90])
@pytest.mark.parametrize("noise_m", [0.0, 0.002])
def test_both_variants_find_the_closed_form_up_to_90_degrees(variant, degrees, noise_m):
    same, _, converged = found(variant, degrees, noise_m)
    assert same.all()
    assert converged.all()


def test_the_printed_slips_cancel_up_to_half_a_turn_and_the_corrected_method_fails_there():
    """The printed Hessian stays definite; that of the cost does not, so that its step leads uphill and is refused."""
    for degrees in (140, 160, 175):
        assert found(Variant.PRINTED, degrees)[0].all()
        same, steps, _ = found(Variant.CORRECTED, degrees)
        assert not same.any()
        assert np.median(steps) < 50
    assert 0 < found(Variant.CORRECTED, 120, n=40)[0].mean() < 1


def test_the_corrected_method_converges_quadratically_and_the_printed_one_linearly():
    draw = np.random.default_rng(3)
    for _ in range(10):
        source, target = planted(draw, 25, 0.008)
        best = align(source, target[None])[0][0]
        errors = {}
        for variant in Variant:
            trail = []
            for most in range(1, 7):
                with pytest.MonkeyPatch.context() as patch:
                    patch.setattr("cospeech.geometry.newton_rotation.MOST_STEPS", most)
                    trail.append(np.abs(newton_rotation(source, target, variant).rotation - best).max())
            errors[variant] = np.array(trail)
        quadratic, linear = errors[Variant.CORRECTED], errors[Variant.PRINTED]
        assert quadratic[2] < 1e-9
        # Each printed step leaves a share of the error that stays the same.
        shares = linear[1:4] / linear[:3]
        assert (shares < 0.6).all()
        assert np.ptp(np.log(shares[1:])) < 1.2
        assert linear[2] > 10 * quadratic[2]


def test_correcting_only_one_of_the_two_signs_stops_at_the_start():
    """With the true Hessian, the step of the printed equation (B.15) leads uphill, and step 6 refuses it."""
    draw = np.random.default_rng(4)
    source, target = planted(draw, 20, 0.0)
    with pytest.MonkeyPatch.context() as patch:
        from cospeech.geometry import newton_rotation as module

        step = module._step
        patch.setattr(module, "_step", lambda *given: -step(*given))
        search = newton_rotation(source, target, Variant.CORRECTED)
    assert search.n_steps == 0
    assert not search.converged

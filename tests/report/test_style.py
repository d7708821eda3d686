"""Style: colours that everybody can distinguish, and figures that are the same bytes each time."""

import itertools
import re

import numpy as np
import pytest

from cospeech.data import vocabulary
from cospeech.rendering import picture
from cospeech.report import style

# Machado, Oliveira and Fernandes 2009: what linear RGB becomes for an eye without one kind of cone.
SIGHT = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
SRGB_TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.072175], [0.0193339, 0.119192, 0.9503041]]
)


def lab(colour, sight):
    """CIELAB of a colour ``#rrggbb`` as an eye sees it."""
    values = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    xyz = SRGB_TO_XYZ @ np.clip(SIGHT[sight] @ linear, 0, 1) / np.array([0.95047, 1, 1.08883])
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("sight", SIGHT)
def test_gestures_can_be_distinguished_by_every_eye(sight):
    seen = {name: lab(colour, sight) for name, colour in vocabulary.GESTURE_COLOURS.items()}
    for one, two in itertools.combinations(seen, 2):
        assert np.linalg.norm(seen[one] - seen[two]) > 25, (one, two)


def test_gestures_are_visible_on_white_and_on_black():
    for colour in vocabulary.GESTURE_COLOURS.values():
        assert 30 < lab(colour, "normal")[0] < 80


def test_a_gesture_of_another_set_has_a_colour_of_its_own():
    assert style.gesture_colours(["rest", "wave"])["wave"] in vocabulary.MORE_COLOURS


def test_videos_and_figures_share_their_colours():
    for label, colour in vocabulary.GESTURE_COLOURS.items():
        assert "#{:02x}{:02x}{:02x}".format(*picture.gesture_colour(label)) == colour


def draw():
    drawn, axes = style.figure(2.0, 1, 2)
    axes[0, 0].plot([0, 1, 2], [3, 1, 2], label="a line")
    axes[0, 1].bar([1, 2], [3, 4])
    drawn.legend(loc="outside upper center")
    return drawn


def test_figures_are_the_same_bytes_without_a_date(tmp_path):
    for name in ("one", "two"):
        style.save(draw(), str(tmp_path / f"{name}.svg"), str(tmp_path / f"{name}.png"))
    for kind in ("svg", "png"):
        assert (tmp_path / f"one.{kind}").read_bytes() == (tmp_path / f"two.{kind}").read_bytes()
    text = (tmp_path / "one.svg").read_text(encoding="utf-8")
    assert "<dc:date>" not in text
    assert not re.search(r"<text[ >]", text)  # letters are outlines: they look alike everywhere
    assert str(tmp_path) not in text

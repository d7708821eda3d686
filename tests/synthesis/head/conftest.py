"""Planted records and a model of three of them, for all tests of head gestures."""

import planted_heads
import pytest

from cospeech.synthesis.head import SETTINGS, model


@pytest.fixture(scope="session")
def records():
    return planted_heads.corpus(seed=1)


@pytest.fixture(scope="session")
def training(records):
    return planted_heads.training_of(records, held_out="r0")


@pytest.fixture(scope="session")
def trained(training):
    return model.train(training, SETTINGS)

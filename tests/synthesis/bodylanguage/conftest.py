"""A trained model that all tests of body language share."""

import pytest
import speaking_body
from speaking_body import SETTINGS

from cospeech.synthesis.bodylanguage import model


@pytest.fixture(scope="module")
def training():
    return speaking_body.training()


@pytest.fixture(scope="module")
def trained(training):
    return model.train(training, SETTINGS)

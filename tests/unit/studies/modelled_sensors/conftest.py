"""The model that is shipped."""

import pytest

from drivemcp.paths import data
from evaluation.modelled_sensors.card import Card, read_card
from evaluation.modelled_sensors.hosted import CARD


@pytest.fixture(scope="session")
def card() -> Card:
    return read_card(data(CARD))

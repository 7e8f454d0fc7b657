"""A driver hears of sensors by what they measure, in each language."""

import pytest

from domain.languages import LANGUAGES
from services.can.health.crosscheck import SENSORS
from services.can.health.sensor_words import QUANTITIES, in_words


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_sensor_that_can_be_doubted_has_words_without_a_signal_s_marks(language: str) -> None:
    for rule in SENSORS:
        told = in_words(rule.field, language)
        assert told in {words[LANGUAGES.index(language)] for words in QUANTITIES.values()}
        assert "_" not in told


def test_another_language_is_told_in_english_and_an_unknown_field_without_its_unit() -> None:
    assert in_words("wheel_fl_mps", "xx") == "wheel speed"
    assert in_words("steering_angle_rad", "en") == "steering angle"

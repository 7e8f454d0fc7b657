"""The networks that travel with the program: their cards fit them, and they tell nothing of the computer that made them."""

import hashlib
import json

import pytest

from drivemcp.paths import data


@pytest.mark.parametrize("name", ["detector", "people", "reader", "weather"])
def test_a_card_names_the_file_beside_it(name: str) -> None:
    card = json.loads(data(f"models/{name}.json").read_text(encoding="utf-8"))
    assert card["sha256"] == hashlib.sha256(data(f"models/{name}.onnx").read_bytes()).hexdigest()


@pytest.mark.parametrize("name", ["detector", "people", "reader", "weather"])
def test_a_network_holds_no_path_of_the_computer_that_made_it(name: str) -> None:
    content = data(f"models/{name}.onnx").read_bytes()
    assert b"site-packages" not in content
    assert b'File "' not in content

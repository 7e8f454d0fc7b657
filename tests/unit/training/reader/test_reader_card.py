"""What is measured of the reader is kept in its card."""

import json
from pathlib import Path

from training.reader.tracks import keep


def test_what_was_measured_replaces_what_stood_there_and_nothing_else(tmp_path: Path) -> None:
    (card := tmp_path / "reader.json").write_text('{"sha256": "0", "tracks": {"old": 1}}', encoding="utf-8")
    keep(card, {"new": 2}, "tracks")
    keep(card, {"count": 3}, "drives", "tele, seed 1")
    keep(card, {"count": 4}, "drives", "tele, seed 2")
    assert json.loads(card.read_text(encoding="utf-8")) == {
        "sha256": "0",
        "tracks": {"new": 2},
        "drives": {"tele, seed 1": {"count": 3}, "tele, seed 2": {"count": 4}},
    }

"""Images from outside: a tag without digest is named."""

import os
from pathlib import Path

from scripts.release.images import outside, unpinned

COMPOSE = (Path(__file__).parents[4] / "docker-compose.yml").read_text(encoding="utf-8")
PINNED = "python:3.11-slim@sha256:" + "0123456789abcdef" * 4


def test_python_and_the_engine_of_retrieval_are_the_images_from_outside() -> None:
    assert set(outside(COMPOSE, {})) == {"PYTHON_IMAGE", "QDRANT_IMAGE"}


def test_a_tag_without_a_digest_is_named_and_one_with_it_is_not() -> None:
    tags = outside(COMPOSE, {})
    assert unpinned(tags) == tags
    assert list(unpinned(outside(COMPOSE, {"PYTHON_IMAGE": PINNED}))) == ["QDRANT_IMAGE"]
    assert unpinned({"PYTHON_IMAGE": PINNED[:-1]}) == {"PYTHON_IMAGE": PINNED[:-1]}


def test_only_variables_of_the_compose_file_count() -> None:
    assert outside(COMPOSE, os.environ | {"OTHER_IMAGE": "x"}).keys() == outside(COMPOSE, {}).keys()

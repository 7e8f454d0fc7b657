"""Answers about a rendered drive: the true graph holds what is there, and scores itself full."""

from functools import cache

import msgspec
import pytest

from services.simulator.render import RendererUnavailable
from studies.gvqa.answer import as_challenge
from studies.gvqa.drive import answered, graphs
from studies.gvqa.files import rows
from studies.gvqa.pairing import pair
from studies.gvqa.scores import report
from studies.gvqa.truth import true_graph
from studies.tracking.recording import DriveName, Step, record


@cache
def _steps() -> list[Step]:
    try:
        return record(DriveName(scenario="urb-rain", seed=7, seconds=1.3))
    except RendererUnavailable as error:
        pytest.skip(f"no OpenGL here: {error}")


def test_the_true_graph_asked_about_itself_is_right_in_everything() -> None:
    looks = [(step, look) for step in _steps() for look in step.looks if look.camera == "front"]
    truths = [true_graph(*one) for one in looks[::7]]
    reference, said = answered("drive", [(truth, truth) for truth in truths])
    found = report(*pair(msgspec.json.decode(as_challenge(said)), rows(reference)))
    assert found.asked > 20
    assert all(one.score == 1.0 for one in found.scores if one.metric != "CIDEr" and one.asked)


def test_what_is_seen_of_a_drive_is_asked_about_what_is_there() -> None:
    pairs = list(graphs(_steps()))
    reference, said = answered("drive", pairs)
    assert len(pairs) == 1
    assert len(said) == len(rows(reference)) == sum(qa.score > 0 for _, true in pairs for qa in true.qa)
    assert sum(bool(one.answer) for one in said) > len(said) / 2

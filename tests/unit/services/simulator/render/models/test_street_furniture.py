"""Street furniture: as high as asked for, the same for the same seed, each style another shape."""

import numpy as np
import pytest

from services.simulator.render.models.mesh import Builder, Mesh
from services.simulator.render.models.street_furniture import STYLES, street_furniture


def built(height: float, seed: int) -> Mesh:
    builder = Builder()
    street_furniture(builder, height, seed)
    return builder.build()


@pytest.mark.parametrize("style", range(STYLES))
def test_each_style_stands_on_the_ground_as_high_as_it_is_asked_to_be(style: int) -> None:
    for seed in range(style, style + 20 * STYLES, STYLES):
        heights = built(1.0, seed).points()[:, 2]
        assert heights.min() == pytest.approx(0.0, abs=0.06)
        assert heights.max() == pytest.approx(1.0, abs=0.25)
        assert np.ptp(built(0.0, seed).points()[:, 2]) < 4.3


def test_the_same_seed_gives_the_same_thing_and_another_seed_another() -> None:
    first, again, other = (built(0.0, seed).points() for seed in (3, 3, 3 + STYLES))
    assert np.array_equal(first, again)
    assert first.shape != other.shape or not np.allclose(first, other)

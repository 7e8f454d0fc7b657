"""One graphics context for all renderer tests; they are skipped where none can be made."""

from collections.abc import Iterator

import numpy as np
import pytest

from services.simulator.render import RendererUnavailable
from services.simulator.scene.scene import Lane, Road, StaticWorld
from training.labelling import LabellingRenderer

LINE = np.array([(float(x), 0.0) for x in range(-40, 301, 10)])
PLAIN = StaticWorld(road=Road(lanes=(Lane(centre_m=LINE, width_m=7.0, left="edge", right="edge"),)))


@pytest.fixture(scope="session")
def renderer() -> Iterator[LabellingRenderer]:
    try:
        made = LabellingRenderer(PLAIN, seed=5)
    except RendererUnavailable as error:
        pytest.skip(str(error))
    yield made
    made.close()


@pytest.fixture
def plain() -> StaticWorld:
    return PLAIN

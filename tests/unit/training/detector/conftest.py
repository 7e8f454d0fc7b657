"""Rendered pictures for the tests of the detector's eight bits."""

import pytest

from services.simulator.render.device.context import RendererUnavailable
from training.dataset.shards import Frames, load_frames, render_stage, write_shard


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> Frames:
    """Three frames of one stage; the test is skipped where no renderer starts."""
    try:
        renderer, shots = render_stage(None, 7, "test", 3)
    except RendererUnavailable as error:
        pytest.skip(str(error))
    renderer.close()
    folder = tmp_path_factory.mktemp("frames")
    write_shard(folder / "test-000000.npz", shots)
    return load_frames(folder, "test")

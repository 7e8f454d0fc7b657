"""What happens where there is no OpenGL."""

import os

import moderngl
import pytest

from services.simulator.render.device.context import RendererUnavailable, open_context


def test_a_missing_driver_is_told_with_the_packages_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(**_: object) -> None:
        raise Exception("libEGL.so not loaded")

    monkeypatch.setattr(moderngl, "create_context", refuse)
    with pytest.raises(
        RendererUnavailable, match=r"libEGL\.so not loaded.*apt-get install libegl1 libgl1 libgl1-mesa-dri"
    ):
        open_context()


def test_the_rasteriser_is_kept_to_one_thread_unless_told_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[str] = []
    monkeypatch.setattr(moderngl, "create_context", lambda **_: seen.append(os.environ["LP_NUM_THREADS"]))
    monkeypatch.delenv("LP_NUM_THREADS", raising=False)
    open_context()
    monkeypatch.setenv("LP_NUM_THREADS", "2")
    open_context()
    assert seen == ["1", "2"]

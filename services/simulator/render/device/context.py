"""The OpenGL context, software rendered, without a screen."""

from __future__ import annotations

import os
from typing import Any

import moderngl

PACKAGES = "libegl1 libgl1 libgl1-mesa-dri"


class RendererUnavailable(RuntimeError):
    """No OpenGL context can be made on this machine; the message says what to install."""


def open_context() -> moderngl.Context:
    """A standalone EGL context of OpenGL 3.3 or newer.

    Sets ``LP_NUM_THREADS`` to 1 unless it is set already: Mesa's rasteriser would else take every core and spoil the
    response times of all other services. Raises ``RendererUnavailable`` where EGL or a driver is missing.
    """
    os.environ.setdefault("LP_NUM_THREADS", "1")
    options: dict[str, Any] = {"backend": "egl"}
    try:
        return moderngl.create_context(require=330, standalone=True, **options)
    except Exception as error:  # the library raises nothing narrower where a driver or the device is absent
        raise RendererUnavailable(
            f"no OpenGL by EGL ({error}); on Debian or Ubuntu: apt-get install {PACKAGES}"
        ) from error

"""The OpenGL context, software rendered, without a screen."""

from __future__ import annotations

import os

import moderngl

PACKAGES = "libegl1 libgl1-mesa-dri"


class RendererUnavailable(RuntimeError):
    """No OpenGL context can be made on this machine; the message says what to install."""


def open_context() -> moderngl.Context:
    """A standalone EGL context of OpenGL 3.3 or newer.

    Sets ``LP_NUM_THREADS`` to 1 unless it is set already: Mesa's rasteriser would else take every core and spoil the
    response times of all other services. Raises ``RendererUnavailable`` where EGL or a driver is missing.
    """
    os.environ.setdefault("LP_NUM_THREADS", "1")
    try:
        return moderngl.create_context(standalone=True, backend="egl", require=330)
    except Exception as error:  # glcontext raises bare Exception when the library or the device is absent
        raise RendererUnavailable(
            f"no OpenGL by EGL ({error}); on Debian or Ubuntu: apt-get install {PACKAGES}"
        ) from error

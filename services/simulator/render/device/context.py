"""The OpenGL context, software rendered, without a screen, and its framebuffers by size: picture and labels."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

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


class Picture(NamedTuple):
    """The drawn frame, its colour and shade as a texture, and the developed picture."""

    raw: moderngl.Framebuffer
    colour: moderngl.Texture
    final: moderngl.Framebuffer


class Targets:
    """Made on first use of a size and kept."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._pictures: dict[tuple[int, int], Picture] = {}

    def picture(self, width_px: int, height_px: int) -> Picture:
        """The drawn frame (colour, shade, depth) and the developed picture."""
        size = (width_px, height_px)
        if size not in self._pictures:
            raw_colour = self._ctx.texture(size, 4)
            raw_colour.filter = (moderngl.LINEAR, moderngl.LINEAR)
            raw_colour.repeat_x = raw_colour.repeat_y = False
            raw = self._ctx.framebuffer([raw_colour], self._ctx.depth_renderbuffer(size))
            final = self._ctx.framebuffer([self._ctx.texture(size, 4)])
            self._pictures[size] = Picture(raw, raw_colour, final)
        return self._pictures[size]

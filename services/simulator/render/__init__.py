"""The camera renderer: a scene in, a picture out, in software OpenGL without a screen."""

from services.simulator.render.device.context import RendererUnavailable, open_context
from services.simulator.render.models.actors import FAMILIES
from services.simulator.render.renderer import Renderer

__all__ = ["FAMILIES", "Renderer", "RendererUnavailable", "open_context"]

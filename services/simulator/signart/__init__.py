"""Our own drawn signs: faces of signs, plates and LED gantries, painted to order, with no font files or pictures."""

from services.simulator.signart.catalogue import CODES, COUNTRIES
from services.simulator.signart.draw import UnknownSign, draw_face, face_size_m

__all__ = ["CODES", "COUNTRIES", "UnknownSign", "draw_face", "face_size_m"]

"""Labels of boxes that leave each other readable: of those that would cover each other the largest box's stays."""

from collections.abc import Sequence

from proto.perception import Box

LETTER_PX, HIGH_PX = 9.0, 38.0
"""A letter and a label of two lines, in pixels of a picture that fills its view; the viewer puts it below its box."""


def readable(boxes: Sequence[Box], labels: Sequence[str]) -> list[str]:
    """The labels, in their order; empty for a box whose label would lie over that of a larger one."""
    kept, taken = [""] * len(boxes), list[tuple[float, float, float]]()
    for index in sorted(range(len(boxes)), key=lambda k: _area(boxes[k]), reverse=True):
        box, half = boxes[index], len(labels[index]) * LETTER_PX / 2
        middle, below = (box.x0_px + box.x1_px) / 2, box.y1_px
        if any(abs(middle - x) < half + other and abs(below - y) < HIGH_PX for x, y, other in taken):
            continue
        taken.append((middle, below, half))
        kept[index] = labels[index]
    return kept


def _area(box: Box) -> float:
    return (box.x1_px - box.x0_px) * (box.y1_px - box.y0_px)

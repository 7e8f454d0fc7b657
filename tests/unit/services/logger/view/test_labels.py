"""Labels in the live view do not cover each other."""

from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from proto.perception import Box
from services.logger.view.labels import HIGH_PX, LETTER_PX, readable


def box(x_px: float, y_px: float, size_px: float) -> Box:
    return Box(x0_px=x_px, y0_px=y_px, x1_px=x_px + size_px, y1_px=y_px + size_px, kind="vehicle", score=0.9)


boxes = st.lists(st.builds(box, st.floats(0, 640), st.floats(0, 360), st.floats(1, 200)), max_size=12)


@given(boxes)
def test_no_two_labels_lie_over_each_other_and_the_largest_box_has_one(found: list[Box]) -> None:
    labels = [f"car {k} m" for k in range(len(found))]
    kept = readable(found, labels)
    assert all(label in (given, "") for label, given in zip(kept, labels, strict=True))
    shown = [(each, label) for each, label in zip(found, kept, strict=True) if label]
    for (one, text), (other, words) in combinations(shown, 2):
        apart_px = abs((one.x0_px + one.x1_px) / 2 - (other.x0_px + other.x1_px) / 2)
        assert apart_px >= (len(text) + len(words)) * LETTER_PX / 2 or abs(one.y1_px - other.y1_px) >= HIGH_PX
    if found:
        largest = max(range(len(found)), key=lambda k: (found[k].x1_px - found[k].x0_px) ** 2)
        assert kept[largest] or len(found) > 1


def test_apart_every_box_keeps_its_label() -> None:
    assert readable([box(10, 10, 20), box(300, 10, 20), box(10, 200, 20)], ["a", "b", "c"]) == ["a", "b", "c"]
    assert readable([box(30, 40, 20), box(14, 12, 60)], ["far", "near"]) == ["", "near"]

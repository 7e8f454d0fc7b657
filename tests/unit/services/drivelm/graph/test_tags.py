"""DriveLM's names of objects are read where they are written in plain digits."""

import pytest

from services.drivelm.graph.tags import Point, points


def test_a_tag_is_a_camera_and_a_place() -> None:
    assert points("What is <c1,CAM_FRONT,330.5,200>?") == [Point("CAM_FRONT", 330.5, 200.0)]


@pytest.mark.parametrize("text", ["<c1,CAM_FRONT,٣٣٠,200>", "<c１,CAM_FRONT,330,200>", "<c1,CAM_FRONT,330,२००>"])
def test_digits_of_other_scripts_name_no_place(text: str) -> None:
    assert points(text) == []

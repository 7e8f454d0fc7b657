"""Whether the right one leads, and how soon."""

import pytest

from studies.tracking.leads import Leads, leads
from studies.tracking.pairing import scene
from tests.unit.studies.tracking.views import actor, label, track, view


def drive(*, enters_at: int, leads_at: int) -> Leads:
    """A car beside us enters the path at a picture and is told to lead at another; ten pictures a second."""
    views = [
        view(
            (actor(1, 20.0, 3.0, in_ego_path=k >= enters_at),), (label(1),), (track(7, 20.0, 3.0),),
            lead=7 if k >= leads_at else None, at_s=0.1 * k,
        )
        for k in range(40)
    ]  # fmt: skip
    return leads(views, [scene(each) for each in views])


@pytest.mark.parametrize(("leads_at", "delay_s"), [(10, 0.0), (8, 0.0), (13, 0.3), (25, 1.5), (99, 2.0)])
def test_a_cut_in_is_timed_from_the_bodys_entering_the_path(leads_at: int, delay_s: float) -> None:
    assert drive(enters_at=10, leads_at=leads_at).cut_in_delays_s == pytest.approx((delay_s,))


def test_who_is_in_the_path_from_the_start_has_not_cut_in() -> None:
    found = drive(enters_at=0, leads_at=4)
    assert found.cut_ins == 0
    assert found.right == pytest.approx(36 / 40)


def test_a_lead_where_there_is_none_is_false() -> None:
    assert drive(enters_at=20, leads_at=10).false == pytest.approx(10 / 20)

"""Labels of who knows the truth."""

from evaluation.metrics import Record
from evaluation.metrics.labels import Drive, labelled
from tests.unit.evaluation.metrics.logs import decided, hazard, steady


def test_labels_follow_truth() -> None:
    acts = tuple(decided(at_s, "ACT") for at_s in (5.0, 5.1))
    drive = Record(truths=steady(10.0, hazards=(hazard("stopped_lead", 2.0, 150.0),)), decisions=acts)
    assert [each.label for each in labelled(drive).labels] == ["false_positive", "late_warning"]
    assert labelled(Record(truths=steady(10.0))).labels == ()


def test_without_truth_nobody_labels() -> None:
    assert labelled(Record()) == Drive((), 0.0)

"""Each question of the reference with the answer given to it; what does not fit together is counted, never dropped."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import msgspec

from studies.gvqa.coordinates import has_broken_tag
from studies.gvqa.files import Given, Place, Row, answers_of, given, rows


class Pair(NamedTuple):
    """A question of the reference and what was answered; None: nothing."""

    asked: Row
    answer: str | None


class Oddities(msgspec.Struct, frozen=True, kw_only=True):
    """What did not fit. Questions that are unanswered, in dispute or answered under other words score 0."""

    unanswered: int = 0
    """Questions of the reference without any answer, or with an empty one."""
    other_question: int = 0
    """Answers whose own question is not the reference's under that id."""
    disputed: int = 0
    """Questions that were given several answers that differ."""
    unknown: int = 0
    """Answers to what the reference does not ask."""
    wrong_form: int = 0
    """Rows of the predictions that are no answer at all."""
    broken_tags: int = 0
    """Answers with something that begins like `<c1,...>` and is no tag."""


def pair(predictions: Any, reference: Sequence[Row]) -> tuple[list[Pair], Oddities]:
    """The pairs in the reference's order. Raises ``UnreadableGraph`` for predictions of neither form."""
    listed = answers_of(predictions)
    if listed is not None:
        kept, wrong = given(listed)
        return _paired(*_by_id(kept, reference), reference, wrong)
    said: dict[Place, list[str]] = {row.place: [row.answer] for row in rows(predictions)}
    return _paired(said, 0, reference, 0)


def _by_id(kept: Iterable[Given], reference: Sequence[Row]) -> tuple[dict[Place, list[str]], int]:
    known: Mapping[str, Place] = {f"{r.place.scene}_{r.place.frame}_{r.number}": r.place for r in reference}
    said: dict[Place, list[str]] = {}
    others = 0
    for one in kept:
        place = known.get(one.id, Place("", "", one.id, 0))
        if one.id in known and one.question is not None and place.question not in one.question:
            others += 1
        else:
            said.setdefault(place, []).append(one.answer)
    return said, others


def _paired(
    said: Mapping[Place, list[str]], others: int, reference: Sequence[Row], wrong: int
) -> tuple[list[Pair], Oddities]:
    asked = {row.place for row in reference}
    pairs = [Pair(row, _one(said.get(row.place, []))) for row in reference]
    return pairs, Oddities(
        unanswered=sum(one.answer is None for one in pairs),
        other_question=others,
        disputed=sum(len(set(answers)) > 1 for place, answers in said.items() if place in asked),
        unknown=sum(len(answers) for place, answers in said.items() if place not in asked),
        wrong_form=wrong,
        broken_tags=sum(has_broken_tag(one.answer) for one in pairs if one.answer is not None),
    )


def _one(answers: Sequence[str]) -> str | None:
    """The one answer; `None` without an answer, for an empty one, or for several that differ."""
    return answers[0] if len(set(answers)) == 1 and answers[0].strip() else None

"""A second look in bounded time."""

import threading
from collections.abc import Sequence

from drivemcp.paths import data
from services.retrieval.encoding.reranking import CANDIDATES, LATE_RERANKER, Reranking
from services.retrieval.library import ABSENT, Library, Request
from services.retrieval.ranking.tuning import Tuning

PACK = (data("rulepacks/GBR-v1"),)
REQUEST = Request(query="speed limit", jurisdiction="GBR", k=5)


class Backwards:
    """Likes the last best."""

    name = "backwards"

    def __init__(self) -> None:
        self.release, self.seen = threading.Event(), 0
        self.release.set()

    def scores(self, question: str, passages: Sequence[str]) -> list[float]:
        assert self.release.wait(10)
        self.seen = len(passages)
        return [float(at) for at in range(len(passages))]


def library(reranker: Backwards, budget_s: float | None) -> Library:
    return Library(PACK, Tuning(lambdas={}), status=ABSENT, reranking=Reranking(reranker, budget_s))


def test_the_first_twenty_are_put_in_the_rerankers_order() -> None:
    judge = Backwards()
    made = library(judge, None)
    plain = Library(PACK, Tuning(lambdas={}), status=ABSENT).search(
        Request(query="speed limit", jurisdiction="GBR", k=CANDIDATES)
    )
    found = made.search(REQUEST)
    assert judge.seen == CANDIDATES
    assert found.reranker == "backwards"
    assert list(found.passages) == list(reversed(plain.passages))[:5]
    made.close()


def test_one_that_is_late_leaves_the_order_says_so_and_is_asked_again() -> None:
    judge = Backwards()
    made = library(judge, 0.01)
    judge.release.clear()
    plain = Library(PACK, Tuning(lambdas={}), status=ABSENT).search(REQUEST)
    for _ in range(3):
        found = made.search(REQUEST)
        assert found.reranker == LATE_RERANKER
        assert found.passages == plain.passages
    judge.release.set()
    made.close()
    assert made.search(Request(query="fog")).reranker == LATE_RERANKER


def test_nothing_found_is_judged_by_nobody() -> None:
    made = library(Backwards(), None)
    assert made.search(Request(query="zzzz")).reranker == ""
    made.close()

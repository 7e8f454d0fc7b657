"""Repeated agreement: what a model without token probabilities says counts as clear only once it has said it again and again."""

from services.drivelm.backends.backend import Answer

AGREEING = 3
"""Answers in a row, of different pictures of one thing, that must agree before one counts as clear."""
AGREED = 0.8
"""The score it then counts with: just clear (``evidence.CLEAR``, 0.75), so that belief takes one more of them."""
Topic = tuple[object, ...]


class Agreement:
    """How often in a row the same was said of each thing, by answers whose score is a stated constant."""

    def __init__(self) -> None:
        self._runs: dict[Topic, tuple[str, int]] = {}

    def weighed(self, topic: Topic, answer: Answer) -> Answer:
        """The answer, its score raised from the third agreeing one on. Abstentions neither add nor break."""
        if answer.measured or not answer.text:
            return answer
        said, count = self._runs.get(topic, ("", 0))
        count = count + 1 if said == answer.text else 1
        self._runs[topic] = (answer.text, count)
        return answer._replace(score=max(answer.score, AGREED)) if count >= AGREEING else answer

    def keep(self, topics: set[Topic]) -> None:
        """Forget all others."""
        self._runs = {topic: run for topic, run in self._runs.items() if topic in topics}

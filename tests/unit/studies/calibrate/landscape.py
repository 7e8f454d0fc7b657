"""A made-up world to search in."""

from studies.calibrate.constants import BY_NAME, Candidate
from studies.calibrate.score import Counts


class Landscape:
    """False interventions fall with act_watched_s, and nothing else matters."""

    def __init__(self) -> None:
        self.asked: list[Candidate] = []

    def __call__(self, candidate: Candidate) -> list[Counts]:
        self.asked.append(candidate)
        row = BY_NAME["act_watched_s"]
        share = (candidate.values[row.name] - row.low) / (row.high - row.low)
        return [Counts(km=10.0, false_interventions=round(1000 * (1.0 - share)))]

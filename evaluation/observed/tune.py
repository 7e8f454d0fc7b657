"""The one number that no single picture tells: how legible driven faces are beside those of the reader's own table."""

from collections.abc import Sequence

import msgspec
import numpy as np

from evaluation.observed.card import Card
from evaluation.observed.compare import FIRST, RIGHTLY, Figures, Share, figures
from evaluation.observed.imagined import imagine
from evaluation.observed.recording import Recording

TRIED = (1.0, 1.5, 2.0, 2.5, 3.0)
SEEDS = (1, 2, 3)
MISSED_M = 10.0
"""What a tenth of the signs believed more or less weighs beside metres of where the first belief comes."""


def tuned(card: Card, recordings: Sequence[Recording]) -> Card:
    """The card with the legibility at which signs are believed from as far, and as often, as they were."""
    measured = figures(recordings)
    tried = [_with(card, legible) for legible in TRIED]
    return min(tried, key=lambda each: _misfit(each, recordings, measured))


def _with(card: Card, legible: float) -> Card:
    return msgspec.structs.replace(card, reading=msgspec.structs.replace(card.reading, legible=legible))


def _misfit(card: Card, recordings: Sequence[Recording], measured: Figures) -> float:
    drawn = [figures([imagine(each, card, seed) for each in recordings]) for seed in SEEDS]
    return sum(
        abs(_far(each) - _far(measured)) + 10 * MISSED_M * abs(_share(each) - _share(measured)) for each in drawn
    )


def _far(told: Figures) -> float:
    values = told[FIRST]
    return float(np.mean(values)) if isinstance(values, list) and values else 0.0


def _share(told: Figures) -> float:
    share = told[RIGHTLY]
    return share.hits / max(share.of, 1) if isinstance(share, Share) else 0.0

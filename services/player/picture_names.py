"""Order, times and cameras of pictures by their names."""

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import datetime
from decimal import Decimal
from itertools import pairwise, permutations
from pathlib import Path
from statistics import median

from drivemcp.files.since_1970 import counts_per_s

NS = 1_000_000_000
_NUMBERS = re.compile(r"([0-9]+)")
_COUNT = re.compile(r"(?<![0-9.])[0-9]{9,19}(?:\.[0-9]+)?(?![0-9])")
"""A number long enough to count since 1970."""
_DATE_AND_TIME = re.compile(
    r"(?<!\d)(20\d\d)([-_.]?)(\d\d)\2?(\d\d)[-_.T ]?(\d\d)([-_.:]?)(\d\d)\6(\d\d)(?:([-_.,]?)(\d{3}|\d{6})(?![A-Y]))?(?: ?([AP])M\b)?(?!\d)"
)
"""Year, month, day, hour, minute, second, and milli- or microseconds, as cameras name their pictures, perhaps of half a day."""
_HALF_DAY_S = 12 * 3600
FASTEST_S = 0.002
"""No camera's pictures follow sooner: what stands behind date and time is a number then."""
_DIGITS_OF_A_FRACTION = (3, 6, 9)
"""Milli-, micro- and nanoseconds."""
_REWRITTEN = (
    (re.compile(r"(?<!\d)(\d\d)([-_.])(1[3-9]|[23]\d)\2(20\d\d)(?!\d)"), r"\4-\1-\3"),
    (re.compile(r"(?<!\d)(\d\d)([-_.])(\d\d)\2(20\d\d)(?!\d)"), r"\4-\3-\1"),
    (re.compile(r"(?<=\d) at (?=\d)"), " "),
    (re.compile(r"(?<!\d)(1\d{9})_(\d{9})(?!\d)"), r"\1.\2"),
)
"""Dates with the year at their end (the day first, unless no month has its number), and seconds beside nanoseconds."""
_PLAUSIBLE_S = (9.4e8, 4.2e9)
"""From 1999 to 2103."""
_SINCE_GPS_S = 3.15e8
"""From 1980, for nanoseconds alone: cameras whose clock has begun with GPS time (Argoverse); no shorter number is so long by chance."""
_HALF_DAYS = re.compile(r"\d[ _.]?[AP]M(?![A-Z])", re.IGNORECASE)
LONGEST_PAUSE_S = 30.0
MOST_CAMERAS = 16
_BETWEEN = "_-. "
_CAMERA = re.compile(r"((?:cam|camera|channel|ch)[-_ ]?\d{1,2}(?!\d))", re.IGNORECASE)
_CAMERA_OR_NUMBER = re.compile(rf"{_CAMERA.pattern}|\d+", re.IGNORECASE)


def times_unused(files: Sequence[Path]) -> str:
    """Why times in most names of a folder do not count, and what to do; empty where they do, or where names hold no times."""
    without = [file for file in files if not (_dated([file.stem]) or _counted([file.stem]))]
    few = len(files) - len(without) < max(2, len(files) / 2)
    if times_in(files) or (few and not _of_unknown_form([file.stem for file in files])):
        return ""
    why = (
        "their unit or form is not known: rename the pictures by seconds since 1970"
        if few
        else f"{without[0].name} holds none: take it away"
        if without
        else f"they do not grow, number the pictures of a second, or pause for more than {LONGEST_PAUSE_S:g} s: divide the folder"
    )
    return f"the times in the names of pictures are not used, since {why}, or give --period"


def _of_unknown_form(names: Sequence[str]) -> bool:
    """Whether names seem to hold times: of half a day, or long numbers that grow by more than one, as a clock from its start does."""
    counts = [[Decimal(each) for each in _COUNT.findall(name) if each[0] != "0"] for name in names]
    grow = all(len(each) == 1 for each in counts) and all(
        later[0] - before[0] > 1 for before, later in pairwise(counts)
    )
    return len(names) > 1 and (grow or all(map(_HALF_DAYS.search, names)))


def cameras_in(files: Sequence[Path]) -> list[str]:
    """What distinguishes pictures of several cameras: the words of their names; else nothing.

    Each camera has times of its own, or, where names hold no times that count, the cameras share most numbers.
    """
    if times_in(files):
        return []
    timed, numbered = (_named(files, of) for of in (_without_times, _without_numbers))
    for named in (timed, numbered):
        if 1 < len(named) <= MOST_CAMERAS and all(map(times_in, named.values())):
            return _labels(named)
    several = {words: each for words, each in numbered.items() if len(each) > 1}
    return _labels(several) if 1 < len(several) <= MOST_CAMERAS and _share_numbers([*several.values()]) else []


def _named(files: Iterable[Path], words_of: Callable[[Path], str]) -> dict[str, list[Path]]:
    named: dict[str, list[Path]] = {}
    for file in files:
        named.setdefault(words_of(file), []).append(file)
    return named


def _without_times(file: Path) -> str:
    return _COUNT.sub("", _DATE_AND_TIME.sub("", _rewritten(file.stem))).strip(_BETWEEN)


def _without_numbers(file: Path) -> str:
    """The words of a name, with the numbers of cameras alone, and its ending."""
    return _CAMERA_OR_NUMBER.sub(r"\1", _without_times(file)).strip(_BETWEEN) + file.suffix.lower()


def _labels(named: Mapping[str, Sequence[Path]]) -> list[str]:
    """The words of each camera's names without an ending that all share; where there are no words, its first picture."""
    endings = {each[0].suffix.lower() for each in named.values()}
    words = {each: each.removesuffix(*endings) if len(endings) == 1 else each for each in named}
    return sorted(words[each] or files[0].name for each, files in named.items())


def _share_numbers(cameras: Sequence[Sequence[Path]]) -> bool:
    """Whether one camera's pictures bear, for half of them at least, the numbers of another's."""
    numbers = [{tuple(map(int, _NUMBERS.findall(_CAMERA.sub("", file.stem)))) for file in files} for files in cameras]
    return any(2 * len(one & other) >= len(one) for one, other in permutations(numbers, 2))


def ordered(files: Iterable[Path]) -> list[Path]:
    """By the numbers in their names, so that frame2 comes before frame10; by value where each name is a number (a time)."""
    found = sorted(files)
    if all(re.fullmatch(r"[0-9]+(\.[0-9]+)?", file.stem) for file in found):
        values = dict(zip(found, _values([file.stem for file in found]), strict=True))
        return sorted(found, key=values.__getitem__)
    return sorted(found, key=_by_numbers)


def times_in(files: Sequence[Path]) -> list[float]:
    """Seconds from the first picture, of those whose names hold date and time, or times since 1970 (s, ms, us or ns); else empty.

    Empty too where two have one time, or a pause is longer than `LONGEST_PAUSE_S`: such pictures are no drive.
    """
    names = [file.stem for file in files]
    times = _dated(names) or _counted(names)
    if len(times) < 2:
        return []
    from_first = [float(each - times[0]) for each in times]
    pauses = [later - before for before, later in pairwise(from_first)]
    return from_first if all(0.0 < each <= LONGEST_PAUSE_S for each in pauses) else []


def _values(written: Sequence[str]) -> list[Decimal]:
    """The numbers of one folder. Where their fractions lack the zeros at their beginning, as 5.50000000 for 5.05 s, they are counts."""
    decimals, fractions = [Decimal(each) for each in written], [each.partition(".")[2] for each in written]
    longest = max(map(len, fractions), default=0)
    digits = next((each for each in _DIGITS_OF_A_FRACTION if longest <= each), 0)
    if not digits or len({*map(len, fractions)}) == 1 or any(re.match("0.", each) for each in fractions):
        return decimals
    counts = [int(value) + Decimal(each or 0).scaleb(-digits) for value, each in zip(decimals, fractions, strict=True)]
    cut = any(re.search(".0$", each) for each in fractions)
    return counts if cut or _unevenness(counts) < _unevenness(decimals) else decimals


def _unevenness(times: Iterable[Decimal]) -> float:
    """How far apart the longest and the shortest step are, against the usual one; infinite where two times are equal."""
    steps = [later - before for before, later in pairwise(sorted(times))]
    return float((max(steps) - min(steps)) / median(steps)) if steps and min(steps) > 0 else math.inf


def _dated(names: Sequence[str]) -> list[Decimal]:
    """Seconds since 1970 of names that all hold date and time, none so soon after another that a number stands there; else empty."""
    found = [each for each in map(_DATE_AND_TIME.search, map(_rewritten, names)) if each is not None]
    if len(found) != len(names):
        return []
    try:
        seconds = [
            int(datetime.fromisoformat(f"{'-'.join(each.group(1, 3, 4))}T{':'.join(each.group(5, 7, 8))}Z").timestamp())
            + _HALF_DAY_S * ((each[11] == "P") - (each[11] is not None and each[5] == "12"))
            for each in found
        ]
    except ValueError:  # no day of the calendar
        return []
    times = [second + Decimal(f"0.{each[10] or 0}") for second, each in zip(seconds, found, strict=True)]
    numbered = _numbered(seconds, times) and not any(each[9] in (".", ",") for each in found)
    return [] if numbered or any(later - before <= FASTEST_S for before, later in pairwise(times)) else times


def _numbered(seconds: Sequence[int], times: Sequence[Decimal]) -> bool:
    """Whether what stands behind the seconds numbers pictures: it grows by one step, and never into the next second as a clock does."""
    steps = [later - before for before, later in pairwise(times)]
    same = [later == before for before, later in pairwise(seconds)]
    within = {step for step, each in zip(steps, same, strict=True) if each}
    return len(within) == 1 and not any(step in within for step, each in zip(steps, same, strict=True) if not each)


def _counted(names: Sequence[str]) -> list[Decimal]:
    """Seconds of names that all hold one time since 1970, of one unit; else empty."""
    found = [[each for each in _COUNT.findall(_rewritten(name)) if _since_1970(Decimal(each))] for name in names]
    counts = _values([each[0] for each in found if len(each) == 1])
    units = {counts_per_s(float(each)) for each in counts}
    if len(counts) != len(names) or len(units) != 1:
        return []
    return [each / Decimal(max(units)) for each in counts]


def _since_1970(count: Decimal) -> bool:
    per_s = counts_per_s(float(count))
    first_s = _SINCE_GPS_S if per_s == NS else _PLAUSIBLE_S[0]
    return first_s < count / Decimal(per_s) < _PLAUSIBLE_S[1]


def _rewritten(name: str) -> str:
    for pattern, better in _REWRITTEN:
        name = pattern.sub(better, name)
    return name


def _by_numbers(file: Path) -> tuple[list[int | str], str]:
    """The words and numbers of a name in turn; capitals and endings are no matter."""
    parts = _NUMBERS.split(file.stem.casefold())
    return [int(part) if place % 2 else part for place, part in enumerate(parts)], file.name

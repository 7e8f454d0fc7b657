"""How often feedback counts: it changes how soon the car acts."""

import msgspec

PAUSE_S = 10.0
WINDOW_S = 600.0
MOST = 6


class Given(msgspec.Struct, frozen=True, kw_only=True):
    """When feedback was given in the last ten minutes."""

    stamps_ns: tuple[int, ...] = ()


def admit(given: Given, now_ns: int) -> tuple[Given, str]:
    """The record with this one in it, or as it was and why it does not count."""
    recent = tuple(stamp for stamp in given.stamps_ns if now_ns - stamp < WINDOW_S * 1e9)
    if recent and now_ns - recent[-1] < PAUSE_S * 1e9:
        return Given(stamps_ns=recent), f"one label every {PAUSE_S:.0f} s counts"
    if len(recent) >= MOST:
        return Given(stamps_ns=recent), f"{MOST} labels in {WINDOW_S / 60:.0f} minutes count"
    return Given(stamps_ns=(*recent, now_ns)), ""

"""Ids of requests and of answers: normal addressing of ISO 15765-4, 11 and 29 bits. An id above 0x7FF has 29 bits."""

FUNCTIONAL_11, FUNCTIONAL_29 = 0x7DF, 0x18DB33F1
TESTER = 0xF1
_OTHERS = tuple(unit for unit in range(0x100) if unit != TESTER)

PHYSICAL_IDS = frozenset(range(0x7E0, 0x7E8)) | frozenset(0x18DA0000 | unit << 8 | TESTER for unit in _OTHERS)
ANSWER_IDS = frozenset(range(0x7E8, 0x7F0)) | frozenset(0x18DA0000 | TESTER << 8 | unit for unit in _OTHERS)
FUNCTIONAL_IDS = frozenset({FUNCTIONAL_11, FUNCTIONAL_29})
REQUEST_IDS = PHYSICAL_IDS | FUNCTIONAL_IDS


def is_extended(arbitration_id: int) -> bool:
    """Whether it takes 29 bits; every request and answer id does or does not by its value alone."""
    return arbitration_id > 0x7FF


def answer_id(request_id: int) -> int:
    """Where the unit asked on a physical id answers."""
    if not is_extended(request_id):
        return request_id + 8
    return 0x18DA0000 | TESTER << 8 | request_id >> 8 & 0xFF


def request_id(answer_id: int) -> int:
    """The physical id of the unit that answers on this one."""
    if not is_extended(answer_id):
        return answer_id - 8
    return 0x18DA0000 | (answer_id & 0xFF) << 8 | TESTER


def functional_ids(request_ids: frozenset[int]) -> tuple[int, ...]:
    """By which ids a car with these units is asked as a whole; one that names none by 11 bits."""
    formats = {is_extended(each) for each in request_ids} or {False}
    return tuple(FUNCTIONAL_29 if extended else FUNCTIONAL_11 for extended in sorted(formats))

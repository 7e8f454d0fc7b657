"""The behaviour lock holds, and names what differs where it does not."""

from typing import Any

import msgspec
import pytest

from tests.replay.compare import decided, names, of_drive, of_log, outcomes
from tests.replay.files import DRIVES, Lock, read_lines, read_lock
from tests.replay.recordings import RECORDINGS
from tests.replay.rendered import RENDERED, processor, published


@pytest.mark.parametrize("name", sorted({*names(), *RECORDINGS}))
def test_a_log_is_decided_as_it_was_locked(name: str) -> None:
    assert not of_log(name, read_lock(), decided(name))


@pytest.mark.parametrize("name", RENDERED)
def test_a_rendered_drive_is_driven_as_it_was_locked(name: str) -> None:
    assert not of_drive(name, read_lock(), published(name))


def test_the_first_tick_and_field_that_differ_are_named_with_both_sides() -> None:
    ours = outcomes("border")
    ours[6] = {**ours[6], "advisory": {**ours[6]["advisory"], "directive": "Drive on the other side"}}
    told = of_log("border", read_lock(), ours)
    assert told.startswith("border: 1 of 200 ticks differ, the first is tick 7: advisory.directive: locked ")
    assert 'now "Drive on the other side"' in told


def test_a_log_that_is_shorter_than_locked_is_told() -> None:
    assert "199 ticks, 200 are locked" in of_log("border", read_lock(), outcomes("border")[:-1])


def test_another_processor_is_held_to_what_does_not_hang_on_pixels_and_to_what_was_seen_at_all() -> None:
    name, kept = next(iter(RENDERED)), read_lock()
    lock: Lock = msgspec.structs.replace(kept, processor=processor())
    elsewhere: Lock = msgspec.structs.replace(lock, processor="another")
    messages = read_lines(DRIVES / f"{name}.jsonl.gz", dict[str, Any])[0]["messages"]
    blurred = [
        {**each, "tracks": [{**one, "x_m": one["x_m"] + 1e-9} for one in each["tracks"]]}
        for each in messages["perception/tracks"]
    ]
    assert of_drive(name, lock, {**messages, "perception/tracks": blurred})
    assert not of_drive(name, elsewhere, {**messages, "perception/tracks": blurred})
    assert "truth/state" in of_drive(name, elsewhere, {**messages, "truth/state": messages["truth/state"][1:]})

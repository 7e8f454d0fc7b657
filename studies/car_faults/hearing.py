"""A case heard by the CAN service's vehicle through frames: its last verdict, and when it was first right."""

from dataclasses import dataclass
from functools import cache

from drivemcp.paths import data
from services.can.diagnostics.trouble_codes import DtcBook
from services.can.profiles.dbc import Dbc
from services.can.profiles.profile import Profile, load_profile
from services.can.vehicle import Vehicle
from studies.car_faults.cases import Case
from studies.car_faults.drives import drive
from studies.car_faults.verdicts import Verdict, right, verdict

DBC = "vehicles/sim/sim.dbc"
BUS = "can0"
HEAR_EVERY = 4
"""Steps between two looks at the degradation: five a second."""


@dataclass(frozen=True, slots=True)
class Heard:
    """What came of a case. A sound drive's verdict is the first that was not sound."""

    case: Case
    said: Verdict
    after_s: float | None
    """From the onset to the first right verdict; None: never, or a sound drive."""


def hear(case: Case) -> Heard:
    """Drive the case and listen."""
    vehicle, said, after_s = _vehicle(), Verdict(), None
    for number, step in enumerate(drive(case.course, case.seed, case.onset, data(DBC))):
        vehicle.ingest(step.frames, step.now_ns, BUS)
        if number % HEAR_EVERY:
            continue
        now = verdict(vehicle.degradation(step.now_ns))
        if case.onset is None:
            said = said if said.says != "sound" else now
            continue
        said = now
        if after_s is None and step.time_s >= case.onset.at_s and right(case, now):
            after_s = step.time_s - case.onset.at_s
    return Heard(case, said, after_s)


def _vehicle() -> Vehicle:
    """Nothing is asked of its units: the verdict rests on what the bus carries by itself."""
    descriptions, profile, book = _known()
    return Vehicle(descriptions, profile, book, lambda _request_id, _payload: None)


@cache
def _known() -> tuple[dict[str, Dbc], Profile, DtcBook]:
    return (
        {BUS: Dbc(data(DBC))},
        load_profile(data("vehicles/sim/profile.toml")),
        DtcBook.load(data("vehicles/dtc.toml")),
    )

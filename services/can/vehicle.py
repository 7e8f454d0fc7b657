"""One car on its buses: what was heard, what is believed of it, and what is asked of it. Knows no transport."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from proto.sensors import CanFrame
from proto.vehicle import Degradation, Ego
from services.can.buses.history import History
from services.can.diagnostics import obd
from services.can.diagnostics.addresses import ANSWER_IDS
from services.can.diagnostics.client import Diagnostics, Refused, Send
from services.can.diagnostics.exchange import Exchange
from services.can.diagnostics.trouble_codes import DtcBook
from services.can.ego import read_ego
from services.can.errors import LinkDown, RequestRefused
from services.can.health import degradation, indicators
from services.can.health.crosscheck import SAMPLE_NS, SENSORS, CrossChecks
from services.can.health.degradation import Assessment, Held
from services.can.health.expected_values import AT_WORK, Shape
from services.can.health.trends import Trends
from services.can.health.trusted import Trusted
from services.can.profiles.dbc import Dbc
from services.can.profiles.privacy import Privacy, curated_signals, installation_salt
from services.can.profiles.profile import Profile, VehicleRow
from services.can.signals.board import Board


class CodeMemory:
    """Trouble codes by unit; a unit that does not answer keeps those it last had. `listed`: the ids on which the units
    that the profile lists answer.
    """

    def __init__(self, listed: Iterable[int] = ()) -> None:
        self._listed = frozenset(listed)
        self._by_unit: dict[int, tuple[tuple[str, ...], int]] = {}
        self.missing: tuple[int, ...] = ()
        """Which of the listed gave no list when they were last asked."""

    def learn(self, answers: Mapping[int, bytes], now_ns: int) -> None:
        """Take positive answers to services 03, 07 or 0A that are whole: a list that breaks off clears no code."""
        fresh = {unit: (obd.codes(answer), now_ns) for unit, answer in answers.items() if obd.is_list(answer)}
        self._by_unit = self._by_unit | fresh
        self.missing = tuple(sorted(self._listed - fresh.keys()))

    @property
    def stamp_ns(self) -> int | None:
        """Stamp (ns) of the oldest answer in use; None before the first answer."""
        return min((stamp_ns for _, stamp_ns in self._by_unit.values()), default=None)

    @property
    def codes(self) -> tuple[str, ...]:
        """All units' codes, sorted."""
        return tuple(sorted({code for codes, _ in self._by_unit.values() for code in codes}))


NS = 1_000_000_000
POLL_WAIT_S = 1.0
"""So long for the answers to a poll; a unit that says that its answer follows later has longer (exchange.py)."""


class Vehicle:
    """Frames in; ego, degradation and answers out. One thread ingests and polls; others read."""

    def __init__(
        self,
        descriptions: Mapping[str, Dbc],
        profile: Profile,
        book: DtcBook,
        send: Send,
        *,
        history_mb: float = 16.0,
        diagnostics_bus: str = "",
        privacy: Privacy | None = None,
        refused: Refused = lambda arbitration_id, data, reason: None,
    ) -> None:
        self.descriptions, self.profile, self.book = descriptions, profile, book
        self.privacy = privacy if privacy is not None else Privacy(salt=installation_salt(None))
        self.curated = curated_signals(profile, descriptions)
        self.board = Board(descriptions, profile)
        self.history = History(descriptions, history_mb)
        self.diagnostics = Diagnostics(send, profile.ecu_names, refused=refused)
        self._diagnostics_bus = diagnostics_bus
        listed = self.diagnostics.responders.listed
        self.stored, self.pending = CodeMemory(listed), CodeMemory(listed)
        self.table = indicators.table(profile.vehicle.tyre_nominal_bar)
        self._health_fields = frozenset(name for psi in self.table for name in psi.fields) | set(indicators.LAMPS)
        self._health_fields |= {"engine_running"} | {
            name.replace("pressure", "temperature").replace("_bar", "_c") for name in indicators.TYRES
        }
        self._checked = tuple(
            name for name in (*(each.field for each in SENSORS), *WITNESSES) if name in self.board.fields
        )
        self.checks = CrossChecks(_shape(profile.vehicle), profile.vehicle.tyre_nominal_bar, self._checked)
        self.trends = Trends(profile.vehicle.tyre_nominal_bar)
        self._next_check_ns = 0
        self.assessment = self._assess(Held(), 0)
        self._polls = ((b"\x03", self.stored), (b"\x07", self.pending))
        self._turn = 0
        self._polling: tuple[Exchange, CodeMemory] | None = None
        self._now_ns = self._last_poll_ns = self._pause_ns = 0

    def ingest(self, frames: Sequence[CanFrame], now_ns: int, bus: str = "") -> None:
        """Frames from a bus, in order; "" is the only one."""
        self._now_ns = now_ns
        self.history.extend(frames, bus)
        messages = [frame for frame in frames if not (frame.error or frame.remote)]
        for part in self._until_checks(messages):
            self.board.ingest(part, now_ns, bus)
            self._cross_check(part[-1].stamp_ns, now_ns)
        if bus != self._diagnostics_bus:
            return
        for frame in messages:
            if frame.arbitration_id in ANSWER_IDS:
                self.diagnostics.on_frame(frame)

    def ego(self, now_ns: int) -> Ego:
        """The ego now."""
        return read_ego(self.trusted, now_ns)

    @property
    def trusted(self) -> Trusted:
        """The board without the sensors that the others contradict."""
        return Trusted(self.board, self.checks.convicted)

    def degradation(self, now_ns: int) -> Degradation:
        """Assess the health now and remember what was believed."""
        before = self.assessment
        known = {fault.field for fault in before.degradation.sensor_faults if fault.kind != "missing"}
        held = degradation.forget(self.table, before.held, self.checks.lying - known)
        self.trends.step(degradation.field_values(self.trusted, self._health_fields, now_ns), now_ns)
        self.assessment = self._assess(held, now_ns)
        if self.assessment.degradation.warning_lamps != before.degradation.warning_lamps:
            self._pause_ns, self._turn = 0, 0  # a lamp came or went: ask for stored codes now
        return self.assessment.degradation

    def poll(self, now_ns: int, period_ns: int) -> None:
        """Ask for trouble codes from time to time without waiting: what was answered is taken at the next call. A bus
        that is down is asked again after a period.
        """
        self._now_ns = now_ns
        if self._polling is not None:
            exchange, memory = self._polling
            if not exchange.over(POLL_WAIT_S):
                return
            memory.learn(self.diagnostics.finish(exchange), now_ns)
            self._polling = None
        if 0 <= now_ns - self._last_poll_ns < self._pause_ns:  # a clock that falls back holds up no question
            return
        try:
            asked = self._ask_for_codes(now_ns)
        except (LinkDown, RequestRefused):
            self._last_poll_ns, self._pause_ns = now_ns, period_ns
            return
        if asked:
            self._last_poll_ns, self._pause_ns = now_ns, period_ns // len(self._polls)

    def _ask_for_codes(self, now_ns: int) -> bool:
        """Whether the line was free. Raises LinkDown, RequestRefused where nothing may be sent."""
        payload, memory = self._polls[self._turn]
        exchange = self.diagnostics.start(payload, lambda: (self._now_ns - now_ns) / NS)
        if exchange is None:
            return False
        self._polling = (exchange, memory)
        self._turn = (self._turn + 1) % len(self._polls)
        return True

    def _assess(self, held: Held, now_ns: int) -> Assessment:
        values = degradation.field_values(self.trusted, self._health_fields, now_ns) | self.checks.measured()
        return degradation.assess(
            self.table, values, self.stored.codes, self.book, held, self.checks.faults, self.trends.found
        )

    def _until_checks(self, frames: Sequence[CanFrame]) -> Iterator[Sequence[CanFrame]]:
        """The frames in parts that end where a cross-check is due, however they came: same frames, same verdicts."""
        start = 0
        for index, frame in enumerate(frames):
            if frame.stamp_ns >= self._next_check_ns or frame.stamp_ns < self._next_check_ns - RESTART_NS:
                yield frames[start : index + 1]
                start = index + 1
        if start < len(frames):
            yield frames[start:]

    def _cross_check(self, stamp_ns: int, now_ns: int) -> None:
        at_ns = min(stamp_ns, now_ns)  # a stamp that runs ahead makes no other sender's values old
        if self._next_check_ns - RESTART_NS <= at_ns < self._next_check_ns or stamp_ns > now_ns + NS:
            return
        self._next_check_ns = at_ns + SAMPLE_NS
        self.checks.step({name: self.board.read(name, at_ns) for name in self._checked}, at_ns)


WITNESSES = ("steering_angle_rad", "brake_pedal", *AT_WORK)
"""What the cross-checks read beside the sensors that they judge."""
RESTART_NS = 2 * NS
"""Stamps that fall back further than this are a source that started again."""


def _shape(row: VehicleRow) -> Shape:
    usual = Shape()
    return Shape(
        track_m=row.track_m or usual.track_m,
        wheelbase_m=row.wheelbase_m or usual.wheelbase_m,
        brake_bar_per_mps2=row.brake_bar_per_mps2,
        brake_bar_full_pedal=row.brake_bar_full_pedal,
    )

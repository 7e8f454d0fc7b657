"""One car on its buses: what was heard, what is believed of it, and what is asked of it. Knows no transport."""

from collections.abc import Mapping, Sequence

from proto.sensors import CanFrame
from proto.vehicle import Degradation, Ego
from services.can import gate, health, indicators, obd
from services.can.board import Board
from services.can.dbc import Dbc
from services.can.diagnostics import Diagnostics, Exchange, Send
from services.can.dtc import DtcBook
from services.can.ego import read_ego
from services.can.health import Assessment, Held
from services.can.history import History
from services.can.profile import Profile

NS = 1_000_000_000
POLL_WAIT_NS = NS


class CodeMemory:
    """Trouble codes by unit; a unit that does not answer keeps those it last had."""

    def __init__(self) -> None:
        self._by_unit: dict[int, tuple[str, ...]] = {}
        self.stamp_ns: int | None = None

    def learn(self, answers: dict[int, bytes], now_ns: int) -> None:
        """Take positive answers to services 03, 07 or 0A."""
        fresh = {unit: obd.codes(answer) for unit, answer in answers.items() if answer and answer[0] != 0x7F}
        if fresh:
            self._by_unit = self._by_unit | fresh
            self.stamp_ns = now_ns

    @property
    def codes(self) -> tuple[str, ...]:
        """All units' codes, sorted."""
        return tuple(sorted({code for codes in self._by_unit.values() for code in codes}))


class Vehicle:
    """Frames in; ego, degradation and answers out. One thread ingests and polls; others read."""

    def __init__(
        self,
        descriptions: Mapping[str, Dbc],
        profile: Profile,
        book: DtcBook,
        send: Send,
        *,
        history_limit: int = 20_000,
    ) -> None:
        self.descriptions, self.profile, self.book = descriptions, profile, book
        self.board = Board(descriptions, profile)
        self.history = History(history_limit)
        self.diagnostics = Diagnostics(send, profile.ecu_names)
        self.stored, self.pending = CodeMemory(), CodeMemory()
        self.table = indicators.table(profile.vehicle.tyre_nominal_bar)
        self._health_fields = frozenset(name for psi in self.table for name in psi.fields) | set(indicators.LAMPS)
        self._health_fields |= {"engine_running"}
        self.assessment = self._assess(Held(), 0)
        self._polls = ((b"\x03", self.stored), (b"\x07", self.pending))
        self._turn = 0
        self._polling: tuple[Exchange, CodeMemory, int] | None = None
        self._next_poll_ns = 0

    @property
    def dbc(self) -> Dbc:
        """The description of the first bus."""
        return next(iter(self.descriptions.values()))

    def ingest(self, frames: Sequence[CanFrame], now_ns: int, bus: str = "") -> None:
        """Frames from a bus, in order; "" is the only one."""
        self.history.extend(frames)
        messages = [frame for frame in frames if not (frame.error or frame.remote)]
        self.board.ingest(messages, now_ns, bus)
        for frame in messages:
            if frame.arbitration_id in gate.ANSWER_IDS:
                self.diagnostics.on_frame(frame)

    def ego(self, now_ns: int) -> Ego:
        """The ego now."""
        return read_ego(self.board, now_ns)

    def degradation(self, now_ns: int) -> Degradation:
        """Assess the health now and remember what was believed."""
        before = self.assessment
        self.assessment = self._assess(before.held, now_ns)
        if self.assessment.degradation.warning_lamps != before.degradation.warning_lamps:
            self._next_poll_ns, self._turn = 0, 0  # a lamp came or went: ask for stored codes now
        return self.assessment.degradation

    def poll(self, now_ns: int, period_ns: int) -> None:
        """Ask for trouble codes from time to time without waiting: what was answered is taken at the next call."""
        if self._polling is not None:
            exchange, memory, since_ns = self._polling
            if not exchange.done.is_set() and now_ns - since_ns < POLL_WAIT_NS:
                return
            memory.learn(dict(self.diagnostics.finish(exchange)), now_ns)
            self._polling = None
        if now_ns < self._next_poll_ns:
            return
        payload, memory = self._polls[self._turn]
        exchange_or_none = self.diagnostics.start(gate.FUNCTIONAL_ID, payload)
        if exchange_or_none is not None:
            self._polling = (exchange_or_none, memory, now_ns)
            self._turn = (self._turn + 1) % len(self._polls)
            self._next_poll_ns = now_ns + period_ns // len(self._polls)

    def _assess(self, held: Held, now_ns: int) -> Assessment:
        values = health.field_values(self.board, frozenset(self._health_fields), now_ns)
        return health.assess(self.table, values, self.stored.codes, self.book, held)

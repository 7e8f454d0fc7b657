"""What a drive came to, added up from the messages as they pass. Pure: messages in, numbers out."""

import math
from collections import Counter
from collections.abc import Iterable, Sequence

import msgspec

from domain.hearing import Hearing
from proto.decision import Advisory, Decision
from proto.health import ServiceHealth
from proto.tools import CallRecords
from proto.truth import ScenarioState, Truth
from services.simulator.truth.hazard_words import names

_URGENT = ("warning", "alarm")


class Percentiles(msgspec.Struct, frozen=True, kw_only=True):
    """Median and 99th percentile in ms, and of how many."""

    p50: float | None
    p99: float | None
    count: int


class Summary(msgspec.Struct, frozen=True, kw_only=True):
    """The end of a drive. Absent numbers could not be measured: no truth, no hazard, nothing closing."""

    scenario: str
    seed: int
    seconds: float
    distance_m: float | None
    infractions: dict[str, int] | None
    collisions: int | None
    overspeed_pct: float | None
    """Mean over time of the share above the true limit, in percent (the paper's overspeed, against the true limit)."""
    ticks: int
    messages: int
    silent_share: float | None
    acts_done: int
    acts_withheld: int
    hazards: int | None
    hazard_response_s: list[float]
    """Onset to the first word about it, per hazard that was spoken of."""
    ttc_first_warning_s: float | None
    advisory_latency_ms: Percentiles
    """Event detection to advisory, as the paper defines it."""
    sensor_to_advice_ms: Percentiles
    """Snapshot stamp to advisory."""
    deadline_misses: dict[str, int]
    tool_calls: dict[str, int]
    degraded_ticks: int
    late_frames: int
    encoder: str
    detector: str
    log: str = ""
    log_verified: bool | None = None
    log_lost: int = 0
    """Messages that are missing from the log."""
    log_missed: int = 0
    """Messages that never reached the logger, as far as the numbers of those that did tell: a network that was cut, a full queue."""
    log_unstamped: str = ""
    """Why its newest head has no time stamp, where one was asked for."""
    log_trouble: str = ""
    """Why the log is not whole; empty: it is."""
    field_of_view: str = ""
    """Of a front camera whose own was not given."""
    restarts: dict[str, int] = {}


class Tally:
    """Counts while the drive goes on."""

    def __init__(self) -> None:
        self.truth: Truth | None = None
        self.advisory: Advisory | None = None
        self.spoken: list[tuple[float, Advisory]] = []
        """All advice that was spoken, and when (s)."""
        self._hearing = Hearing()
        self.scenario: ScenarioState | None = None
        self.health: dict[str, ServiceHealth] = {}
        self._overspeed: list[float] = []
        self._infractions: Counter[str] = Counter()
        self._collisions = 0
        self._collided = False
        self._infraction = ""
        self._kinds: Counter[str] = Counter()
        self._withheld = 0
        self._degraded = 0
        self._event_ms: list[float] = []
        self._snapshot_ms: list[float] = []
        self._misses: Counter[str] = Counter()
        self._calls: Counter[str] = Counter()
        from services.simulator.driver.driver import (
            WARNING_HOLDS_S,  # numpy takes its time: every other command would wait for it
        )

        self._holds_s = WARNING_HOLDS_S
        self._hazards: dict[str, float] = {}
        self._responses: dict[str, float] = {}
        self._ttc: float | None = None

    @property
    def now_s(self) -> float:
        """How long the drive lasts: by the truth; of a recording, by the player."""
        if self.truth is not None:
            return self.truth.time_s
        return self.scenario.time_s if self.scenario is not None else 0.0

    @property
    def ended(self) -> bool:
        """Whether the drive is over: at its end, or before its time."""
        return self.scenario is not None and (self.scenario.finished or bool(self.scenario.problem))

    def add_truth(self, truth: Truth) -> None:
        """One instant of the simulator's truth."""
        self.truth = truth
        if truth.law_limit_mps:
            self._overspeed.append(max(0.0, truth.speed_mps / truth.law_limit_mps - 1.0) * 100)
        if truth.infraction and truth.infraction != self._infraction:
            self._infractions[truth.infraction] += 1
        self._infraction = truth.infraction
        self._collisions += truth.collision and not self._collided
        self._collided = truth.collision
        if truth.hazard and truth.hazard_onset_s is not None and truth.hazard not in self._hazards:
            self._hazards[truth.hazard] = truth.hazard_onset_s
            self._answered_before(truth.hazard, truth.hazard_onset_s)

    def add_advisory(self, advisory: Advisory) -> None:
        """The end of one tick."""
        self.advisory = advisory
        self._kinds[advisory.kind] += 1
        self._withheld += bool(advisory.act_withheld)
        self._degraded += bool(advisory.degraded)
        if advisory.event_to_advice_ms is not None:
            self._event_ms.append(advisory.event_to_advice_ms)
        if advisory.snapshot_to_advice_ms is not None:
            self._snapshot_ms.append(advisory.snapshot_to_advice_ms)
        if self._hearing.hears(advisory, advisory.snapshot_stamp_ns):
            self.spoken.append((self.now_s, advisory))
            self._answered(advisory)
            if advisory.urgency in _URGENT and advisory.hazard:
                self._warned()

    def _answered(self, advisory: Advisory) -> None:
        """A hazard counts as answered once something is said about it; what is said about another thing does not count."""
        for hazard, onset_s in self._hazards.items():
            if names(advisory, hazard):
                self._responses.setdefault(hazard, max(0.0, self.now_s - onset_s))

    def _answered_before(self, hazard: str, onset_s: float) -> None:
        """A warning of the hazard just before its onset counts as an answer at once."""
        if any(said_s >= onset_s - self._holds_s and names(advisory, hazard) for said_s, advisory in self.spoken):
            self._responses.setdefault(hazard, 0.0)

    def _warned(self) -> None:
        truth = self.truth
        if truth is None:
            return
        if self._ttc is None and truth.gap_m is not None and truth.closing_mps is not None and truth.closing_mps > 0.1:
            self._ttc = truth.gap_m / truth.closing_mps

    def add_decision(self, decision: Decision) -> None:
        """The arbiter's own record; kept for its count of decisions."""
        self._kinds[f"arbiter:{decision.kind}"] += 1

    def add_calls(self, message: CallRecords) -> None:
        """Calls, as their callers saw them."""
        for record in message.records:
            if record.side == "caller":
                self._calls[record.tool] += 1
                self._misses[record.tool] += record.status in ("timeout", "busy")

    def add_health(self, health: ServiceHealth) -> None:
        """A service's word of itself."""
        self.health[health.service] = health

    def add_scenario(self, state: ScenarioState) -> None:
        """Where the scenario stands."""
        self.scenario = state

    def detail(self, service: str, name: str, absent: str = "unknown") -> str:
        """A detail of a service's health."""
        health = self.health.get(service)
        return health.detail.get(name, absent) if health else absent

    def latency(self) -> Percentiles:
        """Snapshot to advisory so far."""
        return percentiles(self._snapshot_ms)

    def summary(
        self,
        *,
        restarts: dict[str, int] | None = None,
        log: str = "",
        verified: bool | None = None,
        lost: int = 0,
        unstamped: str = "",
        trouble: str = "",
    ) -> Summary:
        """The numbers so far."""
        truth, scenario = self.truth, self.scenario
        ticks = sum(count for kind, count in self._kinds.items() if ":" not in kind)
        return Summary(
            scenario=scenario.scenario if scenario else "",
            seed=scenario.seed if scenario else 0,
            seconds=self.now_s,
            distance_m=truth.distance_m if truth else None,
            infractions=dict(self._infractions) if truth else None,
            collisions=self._collisions if truth else None,
            overspeed_pct=math.fsum(self._overspeed) / len(self._overspeed) if self._overspeed else None,
            ticks=ticks,
            messages=len(self.spoken),
            silent_share=self._kinds["SILENT"] / ticks if ticks else None,
            acts_done=self._kinds["ACT"],
            acts_withheld=self._withheld,
            hazards=len(self._hazards) if truth else None,
            hazard_response_s=[round(value, 3) for value in self._responses.values()],
            ttc_first_warning_s=self._ttc,
            advisory_latency_ms=percentiles(self._event_ms),
            sensor_to_advice_ms=percentiles(self._snapshot_ms),
            deadline_misses={tool: count for tool, count in sorted(self._misses.items()) if count},
            tool_calls=dict(sorted(self._calls.items())),
            degraded_ticks=self._degraded,
            late_frames=scenario.late_frames if scenario else 0,
            encoder=self.detail("retrieval", "encoder"),
            detector=self.detail("perception", "detector"),
            log=log,
            log_verified=verified,
            log_lost=lost,
            log_missed=sum(topic.lost for topic in self.health["logger"].topics) if "logger" in self.health else 0,
            log_unstamped=unstamped,
            log_trouble=trouble,
            field_of_view=self.detail("perception", "field_of_view_front", ""),
            restarts=restarts or {},
        )


def percentiles(values: Iterable[float]) -> Percentiles:
    """Nearest-rank median and 99th percentile."""
    told = list(values)
    if not told:
        return Percentiles(p50=None, p99=None, count=0)
    p50, p99 = (round(percentile(told, share), 2) for share in (0.5, 0.99))
    return Percentiles(p50=p50, p99=p99, count=len(told))


def percentile(values: Sequence[float], share: float) -> float:
    """By nearest rank: the least of the values that so large a share of them (0 to 1) does not exceed. Raises IndexError for none."""
    return sorted(values)[max(0, math.ceil(share * len(values)) - 1)]

"""Binds the tick to the bus: gathers observations, starts ticks, publishes world, advisory and trace, offers the driver's tools."""

import threading
import time
from typing import Annotated, Any, Literal

import msgspec

from drivemcp.bus.received import Received
from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError, ToolFailed
from drivemcp.finite import finite
from drivemcp.node import Node
from drivemcp.runtime.codehash import code_hash
from drivemcp.service import Service
from proto import topics
from proto.decision import Advisory, ArbitrationRequest, Decision, Feedback, Language, Part, Preferences
from proto.perception import Tracks
from proto.rules import VehicleFacts
from proto.scene import Facts, Unit
from proto.tools import Outcome
from proto.topics import Topic
from services.orchestrator.advisor import advisor_of
from services.orchestrator.driver.answer import Answer, answer_of_told
from services.orchestrator.driver.question import in_language, subject_of
from services.orchestrator.driver.wishes import Given, admit, changed, remembered
from services.orchestrator.events import new, out_of_bounds
from services.orchestrator.experts.ask import ARBITER_DEADLINE_MS, BUDGET_MS, LEAST_MS, within_budget
from services.orchestrator.experts.routing import Call
from services.orchestrator.observations.inputs import (
    Cause,
    M,
    Method,
    Observations,
    Stamped,
    clean,
    experts,
    road_ahead,
)
from services.orchestrator.observations.local_time import told_now_s
from services.orchestrator.speech.wording import say
from services.orchestrator.speed_assistance import MOST_TOLERANCE
from services.orchestrator.state import State
from services.orchestrator.text import plain
from services.orchestrator.tick import Ticked, tick, trace_of

WHOLE_STATE_EVERY = 100
NEEDED: tuple[Topic[Any], ...] = (topics.TRACKS, topics.EGO, topics.CONDITIONS, topics.DEGRADATION)
WELCOME: tuple[Topic[Any], ...] = (topics.LANES, topics.MAP, topics.GNSS)
"""Missed only once they were there."""
LIDAR = "lidar"
MOST_FACTS = 200
CODE = code_hash("proto", "services.arbiter", "services.orchestrator")

Label = Literal["late_warning", "false_positive", "override", "helpful", "annoying"]
Tolerance = Annotated[
    float,
    msgspec.Meta(
        ge=0.0,
        le=MOST_TOLERANCE,
        description="no sound so far above a limit (low: up to 60 km/h, high: above), driver's unit",
        examples=[3],
    ),
]
Question = Annotated[
    str,
    msgspec.Meta(
        max_length=400, description="the driver's question in plain words", examples=["Why did the limit change?"]
    ),
]


class OrchestratorConfig(ServiceConfig, frozen=True, kw_only=True):
    """When a silent perception is ticked over, whose absence degrades a tick, and how the driver is first spoken to."""

    silence_s: float = 0.3
    """A tick is decided without perception after so long without a snapshot."""
    start_s: float = 10.0
    """How long a first snapshot may take; sensors that never spoke have not fallen silent before that."""
    expected: tuple[str, ...] = ("perception", "drivelm", "rules", "retrieval", "weather", "can", "arbiter", "logger")
    """Services whose absence degrades a tick."""
    preferences: Preferences = Preferences()
    method: str = "tools"
    """How advice is come to (`advisor.py`); all but `tools` are baselines, found by entry point."""
    method_settings: dict[str, Any] = msgspec.field(default_factory=dict)
    """Settings of that method."""
    parallel: bool = True
    """Whether the tools of a tick are asked at once, or one after another."""
    learns: bool = True
    """Whether labels (`feedback`) move the arbiter; they are kept all the same."""
    thresholds: dict[str, float] = msgspec.field(default_factory=dict)
    """Event -> threshold, where it is to be another than the table's; bounded by `events.MOVED`."""


class Labelled(msgspec.Struct, frozen=True, kw_only=True):
    """What the tool `feedback` answers."""

    tick: int
    """The tick that the label is about."""
    changes: str
    """What it changes, in the driver's language."""


class LiveAsk:
    """The two waits, over the bus and within the budget of one tick."""

    def __init__(self, node: Node, *, parallel: bool = True) -> None:
        self._node, self._parallel = node, parallel
        self._started_s = time.monotonic()
        self.modelled_ms = 0.0
        """In lockstep: what the calls took by the modelled latencies, waits one after another added up."""

    def spent_ms(self) -> float:
        """Since the tick began; in lockstep as modelled."""
        return self.modelled_ms if self._node.lockstep else (time.monotonic() - self._started_s) * 1e3

    def experts(self, calls: tuple[Call, ...]) -> tuple[Outcome, ...]:
        """In parallel, unless set otherwise; each with min(its deadline, what is left)."""
        batches = [calls] if self._parallel else [(call,) for call in calls]
        return tuple(outcome for batch in batches for outcome in self._at_once(batch))

    def _at_once(self, calls: tuple[Call, ...]) -> tuple[Outcome, ...]:
        outcomes = self._node.call_all(within_budget(calls, self.spent_ms()))
        if self._node.lockstep:
            self.modelled_ms += max((outcome.elapsed_ms for outcome in outcomes), default=0.0)
        # A tool that no service offers leaves no arguments in its outcome; memory and replay use the arguments.
        return tuple(
            msgspec.structs.replace(outcome, arguments=call.arguments)
            for call, outcome in zip(calls, outcomes, strict=True)
        )

    def arbiter(self, request: ArbitrationRequest) -> Decision | None:
        """None where it is not there, too late, or answers what is no decision."""
        left_ms = max(LEAST_MS, min(ARBITER_DEADLINE_MS, BUDGET_MS - self.spent_ms()))
        outcome = self._node.call("arbitrate", {"request": request}, deadline_ms=left_ms)
        if not outcome.ok:
            return None
        try:
            return msgspec.convert(outcome.result, Decision)
        except msgspec.ValidationError as error:
            self._node.log.warning("the arbiter answers what is no decision: %s", error)
            return None


class _AskedOutsideATick(LiveAsk):
    """A driver's question has no tick's budget: each tool has its own deadline."""

    def _at_once(self, calls: tuple[Call, ...]) -> tuple[Outcome, ...]:
        return tuple(self._node.call_all([(call.tool, call.arguments, call.deadline_ms) for call in calls]))


class Orchestrator:
    """The running service: what came in since the last tick, and the state. Ticks run on the node's worker thread."""

    def __init__(self, config: OrchestratorConfig, node: Node) -> None:
        self._config = config
        self._node = node
        self._lock = threading.Lock()
        self._facts: list[Stamped[Facts]] = []
        self._front_end = ""
        self._feedback: list[Feedback] = []
        self._given = Given()
        self._query = ""
        self._told: Advisory | None = None
        """What was spoken last."""
        self._acknowledged = False
        self._preferences: Preferences | None = config.preferences
        self._method = Method(name=config.method, settings=config.method_settings)
        self._advisor = advisor_of(self._method)
        self._seen: set[str] = set()
        self._recalled = node.lockstep  # a lockstep run starts from its configuration alone
        self._ticked_ns: int | None = None
        self._began_ns: int | None = None
        self._logged = False
        self.state = State()

    # -- ticks ---------------------------------------------------------------------------------------------------------

    def on_facts(self, facts: Facts, info: Received[Facts]) -> None:
        """Facts arrive when they arrive; none gates a tick."""
        stamped = clean(Stamped(seq=info.seq, stamp_ns=info.stamp_ns, message=facts))
        self._facts += [stamped] if stamped is not None else []
        self._front_end = plain(facts.backend)
        del self._facts[:-MOST_FACTS]

    def on_tracks(self, tracks: Tracks, info: Received[Tracks]) -> None:
        """A snapshot is complete."""
        self.tick("snapshot")

    def watch(self) -> None:
        """Tick over where sensors fall silent."""
        now_ns = self._node.clock.now_ns()
        began_ns = self._began_ns = min(self._began_ns or now_ns, now_ns)
        if self._ticked_ns is None:
            silent = (now_ns - began_ns) / 1e9 >= self._config.start_s
        else:  # a clock that was set back since tells nothing: that counts as silence
            silent = not 0.0 <= (now_ns - self._ticked_ns) / 1e9 < self._config.silence_s
        if silent:
            self.tick("watchdog")

    def tick(self, cause: Cause) -> None:
        """One tick, from the newest of everything to the advisory."""
        seen = self._observations(cause)
        ask = LiveAsk(self._node, parallel=self._config.parallel)
        ticked = tick(self.state, seen, ask)
        self.state = ticked.state
        self._ticked_ns = seen.now_ns
        advisory = self._timed(ticked, seen, ask)
        self._node.publish(topics.ADVISORY, advisory)
        if advisory.kind != "SILENT":
            self._told = advisory
        self._node.publish(topics.SPEED_ASSISTANCE, ticked.assistance)
        self._node.publish(topics.WORLD, ticked.world)
        number = ticked.state.tick
        logged = "logger" in self._node.alive_services()
        whole = number == 1 or number % WHOLE_STATE_EVERY == 0 or (logged and not self._logged)
        self._logged = logged
        self._node.publish(topics.TRACE, trace_of(ticked, seen, self._versions(ticked), advisory, whole=whole))

    def _timed(self, ticked: Ticked, seen: Observations, ask: LiveAsk) -> Advisory:
        """With both latencies: from event detection, where an event began, and from the snapshot."""
        took_ms: float | None = ticked.latency_ms
        if took_ms is None and new(ticked.events, seen.now_ns):
            took_ms = ask.spent_ms()
        since_ms = (self._node.clock.now_ns() - ticked.world.stamp_ns) / 1e6 + ask.modelled_ms
        spoken, snapshot = ticked.decision.kind != "SILENT", seen.cause == "snapshot"
        return msgspec.structs.replace(
            ticked.advisory,
            event_to_advice_ms=round(took_ms, 3) if spoken and took_ms is not None else None,
            snapshot_to_advice_ms=round(since_ms, 3) if snapshot else None,
        )

    def _versions(self, ticked: Ticked) -> dict[str, str]:
        versions = {"code": CODE, "profile": f"{ticked.decision.profile} {ticked.decision.profile_sha256[:12]}".strip()}
        legal = ticked.state.held.legal
        if legal is not None:
            versions["rulepack"] = legal.rulepack_version
        if self._front_end:
            versions["front_end"] = self._front_end
        return versions

    # -- observations --------------------------------------------------------------------------------------------------

    def _observations(self, cause: Cause) -> Observations:
        node = self._node
        with self._lock:
            feedback, self._feedback = tuple(self._feedback if self._config.learns else ()), []
            query, self._query = self._query, ""
            acknowledged, self._acknowledged = self._acknowledged, False
            preferences, self._preferences = self._preferences, None
        facts, self._facts = tuple(self._facts), []
        gnss, road = node.latest(topics.GNSS), node.latest(topics.MAP)
        return Observations(
            now_ns=node.clock.now_ns(),
            cause=cause,
            tracks=self._stamped(topics.TRACKS),
            lanes=self._stamped(topics.LANES),
            ego=self._stamped(topics.EGO),
            road=clean(Stamped(seq=road.seq, stamp_ns=road.stamp_ns, message=road_ahead(road.message)))
            if road is not None
            else None,
            position_m=(gnss.message.x_m, gnss.message.y_m)
            if gnss is not None and finite((gnss.message.x_m, gnss.message.y_m))
            else None,
            utc_s=self._utc_s(),
            conditions=self._stamped(topics.CONDITIONS),
            degradation=self._stamped(topics.DEGRADATION),
            facts=facts,
            unhealthy=self._unhealthy(),
            absent=tuple(sorted(set(self._config.expected) - node.alive_services())),
            late=tuple(node.late()),
            preferences=preferences,
            feedback=feedback,
            experts=experts(node.catalogue()),
            acknowledged=acknowledged,
            query=query,
            method=self._method,
            thresholds=self._config.thresholds,
        )

    def _utc_s(self) -> float | None:
        """UTC now by the last fix, if that one is fresh and tells it."""
        gnss, health = self._node.latest(topics.GNSS), self._node.health(topics.GNSS)
        if gnss is None or not (health.alive and health.valid):
            return None
        return told_now_s(gnss.message.utc_s, gnss.stamp_ns, self._node.clock.now_ns())

    def _stamped(self, topic: Topic[M]) -> Stamped[M] | None:
        received = self._node.latest(topic)
        if received is None or not self._node.health(topic).valid:
            return None
        return clean(Stamped(seq=received.seq, stamp_ns=received.stamp_ns, message=received.message))

    def _unhealthy(self) -> tuple[str, ...]:
        names = []
        for topic in (*NEEDED, *WELCOME):
            health = self._node.health(topic)
            if health.alive and health.valid:
                self._seen.add(topic.name)
            elif topic in NEEDED or topic.name in self._seen:
                names.append(topic.name)
        return tuple(sorted([*names, *self._without_lidar()]))

    def _without_lidar(self) -> tuple[str, ...]:
        """The LiDAR by name, where perception ranged with it before and does so no more."""
        tracks = self._node.latest(topics.TRACKS)
        if tracks is None or not self._node.health(topics.TRACKS).alive:
            return ()
        if tracks.message.lidar_used:
            self._seen.add(LIDAR)
        return (LIDAR,) if LIDAR in self._seen and not tracks.message.lidar_used else ()

    # -- the driver ----------------------------------------------------------------------------------------------------

    def ask(self, question: str, language: str | None) -> Answer:
        """Answer from the running drive."""
        with self._lock:
            self._query = plain(question)
        state = in_language(self.state, language)
        if subject_of(question) == "told":
            return answer_of_told(self._told, state)
        return self._advisor.answer(question, state, _AskedOutsideATick(self._node))

    def acknowledge(self) -> None:
        """End the sound of an overspeed from the next tick on; what is shown stays."""
        with self._lock:
            self._acknowledged = True

    def give_feedback(self, label: Label, number: int, note: str) -> tuple[int, str]:
        """Queue a label for the next tick; its tick, and what it changes. Raises ToolFailed when there were too many."""
        given = Feedback(label=label, tick=number or self.state.tick, note=plain(note))
        with self._lock:
            self._given, refused = admit(self._given, self._node.clock.now_ns())
            if refused:
                raise ToolFailed(refused, field="label", do="try again later")
            self._feedback.append(given)
        self._remember("feedback", label, {"tick": given.tick, "note": given.note})
        return given.tick, say(self.state.preferences, "feedback", label if self._config.learns else "kept")

    def prefer(self, **fields: Any) -> Preferences:
        """Change preferences from the next tick on, and have them remembered."""
        with self._lock:
            before = self._preferences or self.state.preferences
            after = changed(before, **fields)
            if after == before:  # a page that asks must not be remembered before what was kept is recalled
                return before
            self._preferences = after
        self._remember("preferences", "driver", msgspec.to_builtins(after))
        return after

    def recall(self) -> None:
        """Once the logger is there, the preferences of the last drive."""
        if self._recalled or "recall" not in self._node.catalogue():
            return
        outcome = self._node.call("recall", {"kind": "preferences", "key": "driver", "limit": 1}, deadline_ms=40.0)
        if not outcome.ok:
            return
        self._recalled = True
        kept = remembered(outcome.result)
        with self._lock:
            # What the driver has said in this drive already comes before what was kept.
            if kept is not None and self.state.preferences == self._config.preferences and self._preferences is None:
                self._preferences = msgspec.structs.replace(kept, part=self.state.preferences.part)

    def _remember(self, kind: str, key: str, value: dict[str, Any]) -> None:
        if "remember" in self._node.catalogue():
            outcome = self._node.call("remember", {"kind": kind, "key": key, "value": value}, deadline_ms=100.0)
            if not outcome.ok:
                self._node.log.warning("%s is not remembered: %s", kind, outcome.error)


def build(config: OrchestratorConfig, node: Node) -> None:
    """Wire the orchestrator to a node."""
    if problem := out_of_bounds(config.thresholds):
        raise ConfigError(problem)
    orchestrator = Orchestrator(config, node)
    node.watch_services()
    quiet: tuple[Topic[Any], ...] = (*WELCOME, topics.EGO, topics.CONDITIONS, topics.DEGRADATION)
    for topic in quiet:
        node.subscribe(topic)
    node.subscribe(topics.FACTS, orchestrator.on_facts)
    node.subscribe(topics.TRACKS, orchestrator.on_tracks)
    node.every(0.1, orchestrator.watch)
    node.every(1.0, orchestrator.recall)
    _offer(node, orchestrator)


def _offer(node: Node, orchestrator: Orchestrator) -> None:
    @node.tool(deadline_ms=600, read_only=True)
    def ask(
        question: Question,
        language: Annotated[
            str | None,
            msgspec.Meta(description="en, de, fr, nl, pl, it or es; absent: the driver's", examples=["de"]),
        ] = None,
    ) -> Answer:
        """Answer a driver's question from the running drive: signs, units and country, a changed limit, a warning lamp, the law."""
        return orchestrator.ask(question, language)

    @node.tool(deadline_ms=200, capability="diagnostic", read_only=False, idempotent=False)
    def feedback(
        label: Annotated[Label, msgspec.Meta(description="what the warning was to the driver")],
        tick: Annotated[
            int, msgspec.Meta(description="number of the tick meant; 0: the last one", examples=[1200])
        ] = 0,
        note: Annotated[
            str, msgspec.Meta(max_length=200, description="why, in plain words", examples=["it was a bridge"])
        ] = "",
    ) -> Labelled:
        """A label on a warning: it moves, within bounds, how soon the car acts. Rate-limited and traced."""
        number, changes = orchestrator.give_feedback(label, tick, note)
        return Labelled(tick=number, changes=changes)

    @node.tool(deadline_ms=200, read_only=False)
    def set_preferences(
        language: Annotated[Language | None, msgspec.Meta(description="language of what is said")] = None,
        unit: Annotated[Unit | None, msgspec.Meta(description="the driver's unit of speed")] = None,
        verbosity: Annotated[
            Literal["short", "normal", "full"] | None, msgspec.Meta(description="how much is said")
        ] = None,
        tone: Annotated[Literal["neutral", "friendly"] | None, msgspec.Meta(description="how it is said")] = None,
        muted: Annotated[
            bool | None, msgspec.Meta(description="for this drive; hazards and first notices are spoken anyway")
        ] = None,
        converts: Annotated[bool | None, msgspec.Meta(description="limits are spoken in the driver's unit")] = None,
        tolerance_low: Tolerance | None = None,
        tolerance_high: Tolerance | None = None,
        vehicle: Annotated[
            VehicleFacts | None,
            msgspec.Meta(description="class, trailer, masses, probationary licence: all of them anew"),
        ] = None,
        part: Part | None = None,
    ) -> Preferences:
        """Set the driver's wishes on speech and the facts that limits depend on, from the next message; absent fields stay."""
        return orchestrator.prefer(
            language=language,
            unit=unit,
            verbosity=verbosity,
            tone=tone,
            muted=muted,
            converts=converts,
            tolerance_low=tolerance_low,
            tolerance_high=tolerance_high,
            vehicle=vehicle,
            part=part,
        )

    @node.tool(deadline_ms=200, read_only=False)
    def acknowledge() -> dict[str, bool]:
        """End the sound of an overspeed: it comes again once the speed was at the limit, or the limit falls."""
        orchestrator.acknowledge()
        return {"acknowledged": True}


SERVICE = Service("orchestrator", OrchestratorConfig, build)

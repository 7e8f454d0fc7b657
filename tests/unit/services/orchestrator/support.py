"""A drive in pure form: observations in, ticks out, experts played by functions."""

from collections.abc import Callable, Iterable
from typing import Any

import msgspec
from hypothesis import settings

from domain.units import to_mps
from proto.decision import ArbitrationRequest, Decision, Preferences
from proto.perception import Lanes, Track, Tracks
from proto.rules import Citation, LegalLimit, RulesAnswer, SignMeaning, Situation
from proto.scene import Candidate, Fact, Facts
from proto.sensors import StopLine
from proto.speech import Memory
from proto.tools import Outcome
from proto.vehicle import Degradation, Ego, VehicleHealth
from proto.weather import Conditions
from services.orchestrator.experts.routing import Call
from services.orchestrator.observations.inputs import Observations, RoadAhead, Stamped
from services.orchestrator.speech.local import decide_locally
from services.orchestrator.state import State
from services.orchestrator.tick import Ticked, tick

SECOND = 1_000_000_000
TICK = SECOND // 10
START = 1000 * SECOND
FEW = settings(max_examples=25, deadline=None)
KMH = 1 / 3.6
replace = msgspec.structs.replace
CITED = Citation(document="stvo.md", start=10, end=20, excerpt="0123456789", section="§ 3 StVO")
DEFAULTS = {"urban": 50.0, "rural": 100.0, "motorway": 130.0}


def limit_answer(value: float, unit: str = "km/h", confidence: float = 0.9, **fields: Any) -> RulesAnswer:
    """An answer of the Rules with a limit."""
    limit = LegalLimit(value=value, unit=unit, mps=to_mps(value, unit))  # type: ignore[arg-type]
    return RulesAnswer(
        **{
            "legal_action": "comply_with_limit", "limit": limit, "citations": (CITED,), "confidence": confidence,
            "rulepack_version": "DEU-v1@1.0.0#abc", "basis": "posted", **fields,
        }
    )  # fmt: skip


def conditions(mu: float = 0.9, factor: float = 1.0, **fields: Any) -> Conditions:
    """The weather."""
    return Conditions(
        **{
            "precipitation": "none", "rain_mm_h": 0.0, "visibility_m": 3000.0, "mu_low": mu, "mu_high": min(1.0, mu + 0.1),
            "risk_level": "low", "speed_factor": factor, "following_factor": 1.0, "confidence": 0.9, "wet": False, **fields,
        }
    )  # fmt: skip


def health(h: float = 0.0, **fields: Any) -> VehicleHealth:
    """The car's diagnosis."""
    return VehicleHealth(
        **{
            "h": h, "brake_envelope": 1.0, "indicators": (), "dtcs": (), "warning_lamps": (), "safe_to_drive": "yes",
            "advice": "", "speed_factor": 1.0, "headway_factor": 1.0, "confidence": 0.9, **fields,
        }
    )  # fmt: skip


def meaning(reading: str, **fields: Any) -> SignMeaning:
    """What a sign means."""
    return SignMeaning(
        **{
            "reading": reading, "national_code": "274", "meaning": f"the sign {reading}", "language": "en",
            "legal_action": "comply_with_limit", "limit": None, "citations": (CITED,), "confidence": 0.9,
            "rulepack_version": "DEU-v1@1.0.0#abc", **fields,
        }
    )  # fmt: skip


Expert = Callable[[dict[str, Any]], Any]


def law_of(arguments: dict[str, Any]) -> RulesAnswer:
    """A small law: the lowest sign in force, else the road's default."""
    asked = msgspec.convert(arguments["situation"], Situation)
    posted = [limit for limit in asked.posted if not (limit.scope == "when_wet" and asked.wet is False)]
    if posted:
        lowest = min(posted, key=lambda limit: to_mps(limit.value, limit.unit))
        return limit_answer(lowest.value, lowest.unit)
    return limit_answer(DEFAULTS.get(asked.road_type or "urban", 50.0), basis="default")


EXPERTS: dict[str, Expert] = {
    "applicable_limit": law_of,
    "interpret_sign": lambda a: meaning(a["reading"], limit=_lowest(a["candidates"])),
    "right_of_way": lambda a: limit_answer(50, legal_action="stop", limit=None),
    "lookup_rule": lambda a: limit_answer(50, note="The law says so.", limit=None, legal_action="none"),
    "assess_weather": lambda a: conditions(),
    "vehicle_health": lambda a: health(),
    "read_dtcs": lambda a: {"stored": [], "pending": [], "age_s": 1.0, "warning_lamps": []},
}


def _lowest(candidates: Iterable[dict[str, Any]]) -> LegalLimit | None:
    values = [float(c["reading"].split(":")[1]) for c in candidates if c["reading"].startswith("limit:")]
    return LegalLimit(value=min(values), unit="km/h", mps=min(values) * KMH) if values else None


class Played:
    """Experts played by functions; whoever is missing times out. The arbiter is a function too."""

    def __init__(
        self,
        experts: dict[str, Expert] | None = None,
        arbiter: Callable[[ArbitrationRequest], Decision | None] = lambda request: None,
        status: str = "timeout",
    ) -> None:
        self.table = EXPERTS if experts is None else experts
        self.decide = arbiter
        self.status = status
        self.calls: list[Call] = []
        self.requests: list[ArbitrationRequest] = []

    def experts(self, calls: tuple[Call, ...]) -> tuple[Outcome, ...]:
        """Their answers."""
        self.calls += calls
        return tuple(self._outcome(call) for call in calls)

    def arbiter(self, request: ArbitrationRequest) -> Decision | None:
        """Its decision."""
        self.requests.append(request)
        return self.decide(request)

    def _outcome(self, call: Call) -> Outcome:
        expert = self.table.get(call.tool)
        if expert is None:
            return Outcome(tool=call.tool, status=self.status, arguments=call.arguments)  # type: ignore[arg-type]
        result = msgspec.json.decode(msgspec.json.encode(expert(call.arguments)))
        return Outcome(tool=call.tool, status="ok", result=result, arguments=call.arguments, elapsed_ms=2.0)


def locally(request: ArbitrationRequest) -> Decision:
    """What is decided without the arbiter, where nothing was said before."""
    return decide_locally(request, Memory(), request.stamp_ns)


class Drive:
    """A drive at 10 ticks a second; `see` changes what the sensors show from the next tick on."""

    def __init__(self, ask: Played | None = None, speed_mps: float = 12.0, road: str = "urban", **fields: Any) -> None:
        self.ask = ask or Played()
        self.state = State()
        self.now_ns = START
        self.speed_mps: float | None = speed_mps
        self.weather: Conditions | None = conditions()
        self.car: Degradation | None = Degradation(h=0.0, brake_envelope=1.0)
        self.tracks: tuple[Track, ...] | None = ()
        self.lead: int | None = None
        self.road = road
        self.lines: tuple[StopLine, ...] = ()
        self.junction_m: float | None = None
        self.yaw_radps = 0.0
        self.acceleration_mps2: float | None = 0.0
        self.sight: Lanes | None = None
        self.base = Observations(now_ns=0, **fields)
        self.seq = 0
        self.history: list[tuple[State, Observations, Ticked]] = []
        self.tick(fact("jurisdiction", "DEU"), fact("units", "km/h"), fact("road_type", road))

    def observations(self, *facts: Fact, **fields: Any) -> Observations:
        """What the sensors show now."""
        self.seq += 1

        def stamped(message: Any) -> Any:
            return None if message is None else Stamped(seq=self.seq, stamp_ns=self.now_ns, message=message)

        tracks = None if self.tracks is None else Tracks(camera="front", frame=self.seq, tracks=self.tracks,
                                                         lead_track_id=self.lead)  # fmt: skip
        ego = Ego(speed_mps=self.speed_mps, acceleration_mps2=self.acceleration_mps2, yaw_rate_radps=self.yaw_radps)
        road = RoadAhead(
            segment_id="s1", stop_lines=self.lines, junction_m=self.junction_m, road_class=self.road,
        )  # fmt: skip
        seen = replace(
            self.base,
            now_ns=self.now_ns,
            tracks=stamped(tracks),
            ego=stamped(ego),
            road=stamped(road),
            lanes=stamped(self.sight),
            conditions=stamped(self.weather),
            degradation=stamped(self.car),
            facts=(
                stamped(Facts(facts=tuple(replace(f, frame_stamp_ns=f.frame_stamp_ns or self.now_ns) for f in facts))),
            )
            if facts
            else (),
        )
        return replace(seen, **fields)

    def tick(self, *facts: Fact, **fields: Any) -> Ticked:
        """One tick later."""
        self.now_ns += TICK
        seen = self.observations(*facts, **fields)
        before = self.state
        ticked = tick(before, seen, self.ask)
        self.history.append((before, seen, ticked))
        self.state = ticked.state
        return ticked

    def ticks(self, count: int, **fields: Any) -> Ticked:
        """Several; the last one."""
        for _ in range(count - 1):
            self.tick(**fields)
        return self.tick(**fields)

    def comes_to(self, speed_mps: float | None) -> None:
        """The ego has come to another speed, as if time had gone by: none that it reaches within a tick is believed."""
        self.speed_mps = speed_mps
        self.state = replace(self.state, held=replace(self.state.held, speed=None))

    @property
    def target_mps(self) -> float:
        """The last target."""
        target = self.history[-1][2].fused.target_mps
        assert target is not None
        return target

    def spoken(self) -> list[str]:
        """Directives spoken so far."""
        return [t.advisory.directive for _, _, t in self.history if t.advisory.kind != "SILENT"]


def fact(kind: str, reading: str, **fields: Any) -> Fact:
    """A fact, believed and sure unless told otherwise."""
    head, _, tail = reading.partition(":")
    number = float(tail) if head in ("limit", "zone", "led") and tail.isdigit() else None
    scope = {"limit": "permanent", "zone": "zone", "led": "gantry"}.get(head, "permanent")
    given = {
        "kind": kind, "reading": reading, "confidence": 0.95, "frame_stamp_ns": 0, "track_id": 0, "value": number,
        "unit": "km/h" if number is not None else None, "scope": scope, **fields,
    }  # fmt: skip
    return Fact(**given)


def limit_sign(reading: str, *, track_id: int = 3, passed: bool = True, **fields: Any) -> Fact:
    """A limit sign, just passed unless told otherwise."""
    distance = 0.0 if passed else 30.0
    return fact("limit", reading, **{"track_id": track_id, "passed": passed, "distance_m": distance, **fields})


def end_sign(reading: str, *, track_id: int = 9, **fields: Any) -> Fact:
    """An end of limits, just passed."""
    kind = "limit" if reading in ("limit_end", "all_end", "zone_end", "national", "led:end") else "sign"
    scope = "end" if kind == "limit" else "permanent"
    return fact(kind, reading, **{"track_id": track_id, "passed": True, "scope": scope, "distance_m": 0.0, **fields})


def doubted(reading: str, *others: tuple[str, float], confidence: float = 0.5, **fields: Any) -> Fact:
    """A sign that could be several."""
    candidates = (
        Candidate(reading=reading, confidence=confidence),
        *(Candidate(reading=r, confidence=c) for r, c in others),
    )
    return limit_sign(
        reading, **{"passed": False, "believed": False, "confidence": confidence, "candidates": candidates, **fields}
    )


def actor(gap_m: float, closing_mps: float = 5.0, **fields: Any) -> Track:
    """A vehicle ahead in the path."""
    given = {
        "track_id": 5, "kind": "vehicle", "x_m": gap_m + 4.5, "y_m": 0.0, "vx_mps": -closing_mps, "vy_mps": 0.0,
        "confidence": 0.9, "age_s": 2.0, "steady_s": 2.0, "in_ego_path": True, "sigma_x_m": 0.3, "sigma_vx_mps": 0.3,
        "clearance_m": None if "y_m" in fields else -1.85, **fields,
    }  # fmt: skip
    return Track(**given)


def preferences(**fields: Any) -> Preferences:
    """How the driver wants it."""
    return Preferences(**fields)

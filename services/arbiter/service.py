"""Binds the decision to the bus: own subscriptions, two tools, the decision topic, and braking under a grant."""

import threading
from collections import OrderedDict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec

from domain.ego_speed import Believed
from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError, ToolFailed
from drivemcp.finite import sound
from drivemcp.node import Node
from drivemcp.service import Service
from proto import topics
from proto.decision import ArbitrationRequest, Decision
from proto.topics import Topic
from services.arbiter.assessment.reading import Latest, M, Reading, believed, read
from services.arbiter.braking import budget
from services.arbiter.braking.act import Permission
from services.arbiter.decide import Inputs, Verdict, decide
from services.arbiter.explain import Explanation, explain
from services.arbiter.filters import FULL, check
from services.arbiter.memory import store
from services.arbiter.memory.adapt import is_within_bounds
from services.arbiter.profiles.errors import ProfileError
from services.arbiter.profiles.profile import Profile, load, reachability
from services.arbiter.state import Adapted, ArbiterState, Owed, fresh

if TYPE_CHECKING:
    from drivemcp.runtime.grant_watch import WatchedGrant

MOST_DELTA = 2.0
"""In simulation, beyond the profile's bound: what the evaluation's sweep takes. No margin ever exceeds it."""
GRANT_KEPT_EVERY_S = 10.0
KEPT_DECISIONS = 600
"""A minute of them can still be explained."""


class ArbiterConfig(ServiceConfig, frozen=True, kw_only=True):
    """Which profile, which Delta, and where feedback is kept."""

    profile: str = "calibrated"
    """Name of a shipped profile, or a file."""
    delta: float | None = None
    """The margin Δ; unset: the profile's."""
    state_file: str = ""
    """Where feedback is kept. Empty: `out_dir/arbiter.json`."""
    learnt: tuple[float, float] | None = None
    """Delta and c_min as feedback on earlier drives left them, instead of what a file has; within the profile's bounds."""
    grant_memory: str = ""
    """Where the sequences of grants that have ended are kept (empty: `out_dir/ended-grants.json`; in lockstep: nowhere)."""
    filter: str = FULL
    """What the arbiter holds back: all that it judges unfit, or, for the evaluation, less (`filters.py`)."""


class Arbiter:
    """State and grant of the running service; one decision at a time."""

    def __init__(self, config: ArbiterConfig, profile: Profile, node: Node) -> None:
        self.profile = profile
        self._config = config
        self._node = node
        self._lock = threading.Lock()
        self._file = _state_file(config)
        self._owed = store.load_owed(self._file) if self._file is not None else Owed()
        self._state = self._begin()
        self._speed: Believed | None = None
        self._watched = _watched(config)
        self._refused = ""
        self._permission()
        self._decided: OrderedDict[int, tuple[ArbitrationRequest, Inputs]] = OrderedDict()

    def arbitrate(self, request: ArbitrationRequest) -> Verdict:
        """Decide, remember, and keep what is needed to explain it."""
        with self._lock:
            now_ns = self._node.clock.now_ns()
            inputs = Inputs(
                reading=self._reading(now_ns),
                state=self._state,
                permission=self._permission(),
                now_ns=now_ns,
                delta=self.profile.delta,
                filter=self._config.filter,
            )
            verdict = decide(request, inputs, self.profile)
            self._state = verdict.state
            self._decided[request.tick] = (request, inputs)
            self._decided.move_to_end(request.tick)
            while len(self._decided) > KEPT_DECISIONS:
                self._decided.popitem(last=False)
            owed = budget.owed(self._state.intervention, self._state.run_ns, self._owed)
            owes, self._owed = owed != self._owed, owed
        if request.feedback or owes:
            self.save()
        return verdict

    def explain(self, tick: int | None) -> Explanation:
        """Explain the decision of a tick, or the last one."""
        with self._lock:
            key = next(reversed(self._decided), None) if tick is None else tick
            kept = self._decided.get(key) if key is not None else None
        if kept is None:
            raise ToolFailed(
                f"no decision of tick {tick} is kept",
                field="tick",
                do=f"take one of the last {KEPT_DECISIONS}, or none for the last",
            )
        return explain(*kept, self.profile)

    def keep_grant(self) -> None:
        """Keep how long the grant has counted; a restart does not begin anew."""
        if self._watched is not None:
            self._watched.keep()

    def save(self) -> None:
        """Keep what feedback has moved and what was braked; a disk that refuses costs the memory, not the drive."""
        if self._file is None:
            return
        try:
            store.save(self._file, self._state.adapted, self.profile, self._owed)
        except OSError as error:
            self._node.log.warning("feedback and what was braked are not kept: %s", error)

    def _begin(self) -> ArbiterState:
        state = fresh(self.profile)
        if self._config.learnt is not None:
            delta, c_min = self._config.learnt
            return msgspec.structs.replace(state, adapted=Adapted(delta=delta, c_min=c_min))
        if self._file is None:
            return state
        running = budget.resumed(self._owed, self.profile.act_rest_s)
        return msgspec.structs.replace(state, adapted=store.load(self._file, self.profile), intervention=running)

    def _reading(self, now_ns: int) -> Reading:
        latest = Latest(
            tracks=self._pair(topics.TRACKS),
            ego=self._pair(topics.EGO),
            conditions=self._pair(topics.CONDITIONS),
            degradation=self._pair(topics.DEGRADATION),
            speed=self._speed,
        )
        self._speed = believed(latest, now_ns)
        return read(latest, now_ns, self.profile.act_reading_age_s)

    def _pair(self, topic: Topic[M]) -> tuple[M, int] | None:
        received = self._node.latest(topic)
        # A topic whose last message broke or whose clock is off is not read at all.
        if received is None or not self._node.health(topic).valid:
            return None
        message = sound(received.message)  # a decision on malformed data could not be replayed
        return (message, received.stamp_ns) if message is not None else None

    def _permission(self) -> Permission:
        if self._watched is None:
            return Permission(refused="no grant")
        grant, refused = self._watched.current()
        if refused != self._refused:
            self._refused = refused
            if refused:
                self._node.log.warning("the grant does not count: %s", refused)
        if grant is None:
            return Permission(refused=refused)
        return Permission(
            grant_id=grant.grant_id,
            max_deceleration_mps2=grant.max_deceleration_mps2,
            max_duration_s=grant.max_duration_s,
            refused="",
            envelope=grant.envelope,
        )


def build(config: ArbiterConfig, node: Node) -> None:
    """Wire the arbiter to a node."""
    check(config.filter, lockstep=node.lockstep)
    profile = _profile(config)
    node.log.info(reachability(profile).text)
    own: tuple[Topic[Any], ...] = (topics.TRACKS, topics.EGO, topics.CONDITIONS, topics.DEGRADATION)
    for topic in own:
        node.subscribe(topic)
    arbiter = Arbiter(config, profile, node)
    node.detail["profile"] = f"{profile.name} {profile.sha256[:12]}"
    node.detail["reach"] = reachability(profile).text
    node.detail["filter"] = config.filter

    @node.tool(deadline_ms=20, read_only=False, idempotent=False)
    def arbitrate(request: ArbitrationRequest) -> Decision:
        """SILENT, SPEAK or ACT for one tick, with the numbers behind it. Brakes only under a grant and on its own reading."""
        verdict = arbiter.arbitrate(request)
        node.publish(topics.DECISION, verdict.decision)
        if verdict.command is not None:
            node.publish(topics.BRAKE, verdict.command)
        return verdict.decision

    @node.tool(deadline_ms=1000)
    def explain_decision(
        tick: Annotated[
            int | None, msgspec.Meta(description="number of the decision's tick; absent: the last", examples=[1200])
        ] = None,
    ) -> Explanation:
        """Why a decision came out so: numbers, objections to acting, and the smallest change that would flip it."""
        return arbiter.explain(tick)

    node.on_close(arbiter.save)
    node.every(GRANT_KEPT_EVERY_S, arbiter.keep_grant)


def _profile(config: ArbiterConfig) -> Profile:
    try:
        profile = load(config.profile)
    except (ProfileError, OSError) as error:
        raise ConfigError(f"profile {config.profile!r} of the arbiter: {error}") from None
    if config.learnt is not None and not is_within_bounds(
        Adapted(delta=config.learnt[0], c_min=config.learnt[1]), profile
    ):
        raise ConfigError(
            f"learnt = {list(config.learnt)} lies outside the bounds of Delta and c_min in {config.profile!r}"
        )
    if config.delta is None:
        return profile
    high = MOST_DELTA if config.lockstep else profile.delta_high
    if not profile.delta_low <= config.delta <= high:
        raise ConfigError(f"delta must lie in [{profile.delta_low}, {high}], not {config.delta}")
    return msgspec.structs.replace(profile, delta=config.delta)


def _state_file(config: ArbiterConfig) -> Path | None:
    if config.state_file:
        return Path(config.state_file)
    # Two lockstep runs with one seed must agree: nothing is carried over from the run before.
    return None if config.lockstep else Path(config.out_dir) / "arbiter.json"


def _watched(config: ArbiterConfig) -> "WatchedGrant | None":
    if not config.grant_file:
        return None
    from drivemcp.runtime.grant_watch import Floor, TrustedKeys, WatchedGrant

    file = Path(config.grant_file)
    if not file.is_file():
        raise ConfigError(f"cannot read the grant {file}: no such file")
    # two lockstep runs must agree: nothing is carried over from the run before
    kept = None if config.lockstep else Path(config.grant_memory or Path(config.out_dir) / "ended-grants.json")
    return WatchedGrant(
        file,
        keys=TrustedKeys(config.trusted_keys, config.trusted_keys_file),
        vehicle=config.vehicle,
        capability=topics.BRAKE.name,
        floor=Floor(kept),
    )


SERVICE = Service("arbiter", ArbiterConfig, build)

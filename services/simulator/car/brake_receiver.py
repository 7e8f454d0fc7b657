"""The receiver of braking commands: bounds each again, lets go on expiry, when the driver overrides, and when its own budget is spent."""

from dataclasses import dataclass, replace

from proto.decision import BrakeCommand, Envelope

MAX_DECELERATION_MPS2: dict[Envelope, float] = {"soft": 6.0, "emergency": 6.5}
"""No command brakes harder, whatever it says."""
MAX_JERK_MPS3 = 10.0
MAX_VALID_NS = 200_000_000
MAX_DURATION_S: dict[Envelope, float] = {"soft": 3.0, "emergency": 20.0}
"""A moving car is braked for no longer than this within any window of as long and ``REST_S``, whatever command asks."""
REST_S = 1.0
"""Nor so long after the driver has overridden."""
PAUSE_S = 0.3
"""A pause of less counts as braked through."""
ACCELERATOR_THRESHOLD, ACCELERATOR_RATE_PER_S = 0.5, 0.6
"""A pedal that merely keeps the speed is no override; one that is pushed is."""
STEERING_RATE_THRESHOLD_RADPS = 0.35
STILL_MPS = 0.3
"""Slower the car stands: holding it there spends nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Controls:
    """What the driver does: pedals from 0 to 1, how fast the driver moves the accelerator and turns the wheel."""

    accelerator: float = 0.0
    accelerator_rate_per_s: float = 0.0
    brake: float = 0.0
    steering_rate_radps: float = 0.0

    @property
    def overrides(self) -> bool:
        """Whether the driver has the last word now. A foot on the brake has not: the harder of foot and command brakes."""
        return (
            self.accelerator > ACCELERATOR_THRESHOLD
            or self.accelerator_rate_per_s > ACCELERATOR_RATE_PER_S
            or abs(self.steering_rate_radps) > STEERING_RATE_THRESHOLD_RADPS
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Brake:
    """The receiver's state; stamps of commands in ns of the simulation, budget in seconds of its own steps."""

    command: BrakeCommand | None = None
    until_ns: int = 0
    applied_mps2: float = 0.0
    """Deceleration applied now, positive."""
    run_s: float = 0.0
    """Its own clock: the steps made."""
    braked: tuple[tuple[float, float], ...] = ()
    """Spans of its own clock in which it braked the moving car, oldest first."""
    rests_until_s: float = 0.0
    overridden: bool = False

    def receive(self, command: BrakeCommand, now_ns: int) -> "Brake":
        """Take a command; one that is not a plain positive number with a lifetime is dropped."""
        sane = 0.0 < command.deceleration_mps2 < 1e3 and 0.0 < command.jerk_mps3 < 1e4 and command.valid_for_ns > 0
        if not sane or not command.grant_id:
            return self
        return replace(self, command=command, until_ns=now_ns + min(command.valid_for_ns, MAX_VALID_NS))

    def step(self, now_ns: int, dt: float, controls: Controls, speed_mps: float) -> "Brake":
        """The brake a step of `dt` seconds later, in a car of that speed."""
        now = replace(self, run_s=self.run_s + dt)
        wanted = now._wanted(now_ns, dt, controls, speed_mps)
        if wanted <= 0.0 or now.command is None:
            return now._release(now_ns, controls)
        applied = min(wanted, self.applied_mps2 + min(now.command.jerk_mps3, MAX_JERK_MPS3) * dt)
        braked = now.braked if speed_mps < STILL_MPS else now._spent(dt)
        return replace(now, applied_mps2=applied, braked=braked, overridden=False)

    def _wanted(self, now_ns: int, dt: float, controls: Controls, speed_mps: float) -> float:
        if self.command is None or now_ns >= self.until_ns or controls.overrides or self.run_s < self.rests_until_s:
            return 0.0
        if (
            speed_mps >= STILL_MPS
            and self._braked_s(self.command.envelope) + dt > MAX_DURATION_S[self.command.envelope]
        ):
            return 0.0
        return min(self.command.deceleration_mps2, MAX_DECELERATION_MPS2[self.command.envelope])

    def _braked_s(self, envelope: Envelope) -> float:
        since_s = self.run_s - MAX_DURATION_S[envelope] - REST_S
        return sum(max(0.0, until_s - max(from_s, since_s)) for from_s, until_s in self.braked)

    def _spent(self, dt: float) -> tuple[tuple[float, float], ...]:
        kept = tuple(each for each in self.braked if each[1] > self.run_s - max(MAX_DURATION_S.values()) - REST_S)
        if kept and self.run_s - dt - kept[-1][1] < PAUSE_S:
            return (*kept[:-1], (kept[-1][0], self.run_s))
        return (*kept, (self.run_s - dt, self.run_s))

    def _release(self, now_ns: int, controls: Controls) -> "Brake":
        overridden = self.command is not None and controls.overrides
        held = self.command if now_ns < self.until_ns and not controls.overrides else None
        return replace(
            self,
            command=held,
            until_ns=self.until_ns if held else 0,
            applied_mps2=0.0,
            rests_until_s=self.run_s + REST_S if overridden else self.rests_until_s,
            overridden=overridden,
        )

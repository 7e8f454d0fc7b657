"""The receiver of braking commands: bounds each again, lets go on expiry and as soon as the driver does something."""

from dataclasses import dataclass, replace

from proto.decision import BrakeCommand

MAX_DECELERATION_MPS2 = 6.0
"""No command brakes harder, whatever it says."""
MAX_JERK_MPS3 = 10.0
MAX_VALID_NS = 200_000_000
MAX_DURATION_S = 3.0
"""After this long without a pause the brake lets go for ``REST_S``, whoever asks."""
REST_S = 1.0
BRAKE_THRESHOLD = 0.08
ACCELERATOR_THRESHOLD, ACCELERATOR_RATE_PER_S = 0.5, 0.6
"""A pedal that merely keeps the speed is no override; one that is pushed is."""
STEERING_RATE_THRESHOLD_RADPS = 0.35


@dataclass(frozen=True, slots=True, kw_only=True)
class Controls:
    """What the driver does: pedals from 0 to 1, how fast he moves the accelerator and turns the wheel."""

    accelerator: float = 0.0
    accelerator_rate_per_s: float = 0.0
    brake: float = 0.0
    steering_rate_radps: float = 0.0

    @property
    def overrides(self) -> bool:
        """Whether he has the last word now."""
        return (
            self.accelerator > ACCELERATOR_THRESHOLD
            or self.accelerator_rate_per_s > ACCELERATOR_RATE_PER_S
            or self.brake > BRAKE_THRESHOLD
            or abs(self.steering_rate_radps) > STEERING_RATE_THRESHOLD_RADPS
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Brake:
    """The receiver's state; times in ns of the simulation."""

    command: BrakeCommand | None = None
    until_ns: int = 0
    applied_mps2: float = 0.0
    """Deceleration applied now, positive."""
    braking_s: float = 0.0
    resting_s: float = 0.0
    overridden: bool = False

    def receive(self, command: BrakeCommand, now_ns: int) -> "Brake":
        """Take a command; one that is not a plain positive number with a lifetime is dropped."""
        sane = 0.0 < command.deceleration_mps2 < 1e3 and 0.0 < command.jerk_mps3 < 1e4 and command.valid_for_ns > 0
        if not sane or not command.grant_id:
            return self
        return replace(self, command=command, until_ns=now_ns + min(command.valid_for_ns, MAX_VALID_NS))

    def step(self, now_ns: int, dt: float, controls: Controls) -> "Brake":
        """The brake a step later."""
        wanted = self._wanted(now_ns, controls)
        if wanted <= 0.0:
            return self._release(now_ns, dt, controls)
        jerk = min(self.command.jerk_mps3 if self.command else 0.0, MAX_JERK_MPS3)
        applied = min(wanted, self.applied_mps2 + jerk * dt)
        resting = REST_S if self.braking_s + dt >= MAX_DURATION_S else 0.0
        return replace(self, applied_mps2=applied, braking_s=self.braking_s + dt, resting_s=resting, overridden=False)

    def _wanted(self, now_ns: int, controls: Controls) -> float:
        if self.command is None or now_ns >= self.until_ns or controls.overrides or self.resting_s > 0.0:
            return 0.0
        return min(self.command.deceleration_mps2, MAX_DECELERATION_MPS2)

    def _release(self, now_ns: int, dt: float, controls: Controls) -> "Brake":
        held = self.command if now_ns < self.until_ns and not controls.overrides else None
        overridden = self.command is not None and controls.overrides
        return Brake(
            command=held,
            until_ns=self.until_ns if held else 0,
            resting_s=max(0.0, self.resting_s - dt),
            overridden=overridden,
        )

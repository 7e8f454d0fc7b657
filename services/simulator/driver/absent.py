"""A driver that does nothing: the feet stay where they are, whatever is said or comes. For tests of what the car does alone."""

from typing import Literal

from services.simulator.driver.driver import Advice, Driver, DriverView, Wish, pedals

DriverKind = Literal["drawn", "absent"]
"""`drawn`: the driver of the seed, from the population; `absent`: a driver that keeps the pedals as they are."""


class AbsentDriver(Driver):
    """Keeps the pedals of a car at constant speed, hears nothing and looks at nothing."""

    def hear(self, advice: Advice, time_s: float) -> None:
        """A message changes nothing."""

    def drive(self, view: DriverView, dt: float) -> Wish:
        """The wish of every step: constant speed."""
        return pedals(0.0)

    def distracted(self, time_s: float) -> bool:
        """Always."""
        return True


DRIVERS: dict[DriverKind, type[Driver]] = {"drawn": Driver, "absent": AbsentDriver}

"""Indicators, trends and cross-checks of the car's health."""

from scripts.reference.markdown import code, page, table
from services.can.health.crosscheck import SENSORS
from services.can.health.indicators import table as indicators
from services.can.health.trends import RULES

NOMINAL_BAR = (2.4, 2.4, 2.6, 2.6)
"""Any sound tyres: the page names no pressure."""


def health() -> str:
    """The tables behind `vehicle_health`."""
    told = [
        (f"`{psi.name}`", code(psi.fields), f"{psi.weight:g}", f"{psi.loss:g}", f"{psi.loss_unknown:g}", psi.gravity)
        for psi in indicators(NOMINAL_BAR)
    ]
    trends = [
        (
            f"`{rule.name}`", f"`{rule.field}`", f"{rule.threshold:g} {rule.unit}", f"{rule.period_s:g} s",
            f"{rule.period_s * rule.points / 60:.1f} min", f"{rule.within_min:g} min",
        )
        for rule in RULES
    ]  # fmt: skip
    sensors = [
        (f"`{rule.field}`", f"{rule.noise:g}", f"{rule.moves:g}" if rule.moves else "", f"{rule.jump:g}" if rule.jump else "")
        for rule in SENSORS
    ]  # fmt: skip
    return page(
        "Indicators of the car's health",
        "[The health of the car](health.md) explains these tables.",
        "## Indicators",
        "`services/can/health/indicators.py` holds reasons and sources.",
        table(("indicator", "read from", "weight", "braking lost at psi = 1", "while unknown", "at psi = 1"), told),
        "## Trends",
        table(("trend", "field", "threshold", "looked at every", "window", "told within"), trends),
        "## Cross-checks",
        table(("sensor", "noise from", "stuck: others moved by", "runs ahead of nature by"), sensors),
    )

"""How a drive begins: what a car knows that has driven before, of where it stands and whom it speaks to."""

from services.simulator.plan import Scenario


def start_settings(scenario: Scenario) -> tuple[str, ...]:
    """The front end's home is the scenario's first country; the driver is spoken to in his language. As `--set` has them."""
    return (
        f"drivelm.home={scenario.country}",
        f"orchestrator.preferences.language={scenario.driver_language}",
    )

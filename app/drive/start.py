"""How a drive begins: what a car knows that has driven before, of where it stands and whom it speaks to."""


def start_settings(country: str, driver_language: str) -> tuple[str, ...]:
    """The front end's home is the scenario's first country; the driver is spoken to in the driver's language. As `--set` has them."""
    return (
        f"drivelm.home={country}",
        f"orchestrator.preferences.language={driver_language}",
    )

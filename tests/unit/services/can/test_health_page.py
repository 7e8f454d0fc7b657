"""The page of the car's health says what the tables say."""

from drivemcp.paths import data
from services.can.health.crosscheck import SENSORS
from services.can.health.indicators import table
from services.can.health.trends import RULES

PAGE = data("docs/reference/health.md").read_text(encoding="utf-8")


def rows(first: str) -> dict[str, list[str]]:
    """The rows of the table that begins with this heading, by their first cell."""
    lines = PAGE.split(f"| {first} |", 1)[1].splitlines()[2:]
    found = {}
    for line in lines:
        if not line.startswith("|"):
            break
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        found[cells[0].strip("`")] = cells
    return found


def test_every_indicator_stands_on_the_page_with_its_fields_weight_and_losses() -> None:
    told = rows("indicator")
    indicators = {psi.name: psi for psi in table((2.4, 2.4, 2.6, 2.6))}
    assert told.keys() == indicators.keys()
    for name, psi in indicators.items():
        fields = ", ".join(f"`{field}`" for field in psi.fields)
        assert told[name][1:] == [
            fields, f"{psi.weight:g}", f"{psi.loss:g}", f"{psi.loss_unknown:g}", psi.gravity,
        ]  # fmt: skip


def test_every_trend_and_every_checked_sensor_stands_on_the_page() -> None:
    told = rows("trend")
    assert told.keys() == {rule.name for rule in RULES}
    assert all(told[rule.name][1] == f"`{rule.field}`" for rule in RULES)
    assert {name: cells[1] for name, cells in rows("sensor").items()} == {
        rule.field: f"{rule.noise:g}" for rule in SENSORS
    }

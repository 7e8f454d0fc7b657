"""The constants of all profiles as a Markdown table; docs/explanation/safety.md carries it, a test keeps the two in step."""

from services.arbiter.profiles.profile import FOLDER, names, read_file

BEGIN, END = "<!-- constants -->", "<!-- /constants -->"


def constants_table() -> str:
    """One row per constant: symbol, value per profile, unit, and the default profile's source and reason."""
    files = {name: read_file((FOLDER / f"{name}.toml").read_bytes(), name) for name in names()}
    calibrated = files["calibrated"].constants
    head = ["constant", "symbol", *files, "unit", "source", "reason"]
    lines = [f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"]
    for key, row in calibrated.items():
        values = [f"{file.constants[key].value:g}" for file in files.values()]
        lines.append(f"| `{key}` | {row.symbol} | {' | '.join(values)} | {row.unit} | {row.source} | {row.reason} |")
    return "\n".join(lines)


def with_table(document: str) -> str:
    """The document with the table between its marks replaced."""
    before, _, rest = document.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{constants_table()}\n{END}{after}"


if __name__ == "__main__":
    import sys
    from pathlib import Path

    file = Path(sys.argv[1])
    file.write_text(with_table(file.read_text(encoding="utf-8")), encoding="utf-8")

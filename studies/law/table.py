"""The scores as text."""

from studies.law.scores import Measured, Score


def table(measured: Measured) -> str:
    """One line per pack, then their sum, then what was answered wrongly."""
    rows = [*measured.by_pack.items(), ("together", measured.total)]
    lines = [f"{measured.name:<24}{'asked':>7}{'right':>7}{'limit above':>13}"]
    lines += [_line(name, score) for name, score in rows]
    lines += [f"  wrong: {text}" for text in measured.wrong]
    return "\n".join(lines) + "\n\n"


def _line(name: str, score: Score) -> str:
    return f"  {name:<22}{score.asked:>7}{score.right:>7}{score.above:>13}"

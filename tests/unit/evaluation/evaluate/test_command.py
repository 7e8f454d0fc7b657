"""What the command line refuses, before anything is driven."""

from contextlib import nullcontext
from pathlib import Path

import pytest

from drivemcp.cli import run


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (
            ("results", "--method", "Nothing"),
            "--method: there is no method 'Nothing'; there are DriveMCP, No CAN context, ",
        ),
        (("results", "--km-of", "No tracking=5"), "--km-of: there is no method 'No tracking'"),
        (("results", "--method", "No tracking"), "--method: the table results has no row of No tracking"),
        (("results", "--runs-of", "nothing=3"), "--runs-of: TABLE=N with TABLE one of results, corruption, "),
        (("results", "--runs-of", "corruption=0"), "--runs-of: "),
    ],
)
def test_what_is_asked_wrongly_is_named(
    asked: tuple[str, ...], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) if "--runs-of" in asked else nullcontext():
        assert run(["evaluate", *asked, "--out", str(tmp_path)]) == 2
    assert told in capsys.readouterr().err
    assert not list(tmp_path.glob("runs/*/metrics.json"))

"""The commands of the page "Your first drive", and what it says of them."""

import re
from pathlib import Path

from tests.unit.docs.page_commands import blocks, page, run

PAGE = page("tutorial/your-first-drive.md")


def test_the_drive_says_what_the_page_reads(tmp_path: Path) -> None:
    told = run(blocks(PAGE, "sh"), tmp_path, 360)
    shown = " ".join(told.split())
    for line in blocks(PAGE, "text").splitlines():
        words = line.strip().removesuffix("...").split()
        assert " ".join(words) in shown
    assert "silent share 98.5%" in told
    assert "200 ticks, 200 identical decisions, 0 different" in told
    assert "SPEAK: Brake: vehicle ahead" in told
    assert told.count("verified") >= 3
    broken = told[told.rindex("is up") :]
    assert re.search(r"SPEAK (advice|warning)\s+.*(Pull over|Stop safely|Drive with care)", broken)
    assert list(tmp_path.glob("out/first/*/report.html"))

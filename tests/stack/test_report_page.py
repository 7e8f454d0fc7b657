"""The report of a drive in a real browser: it asks no host, it fits a phone, and it reads in light, dark and on paper."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from app.replay.again import AtHand
from app.report.command import write_report
from tests.browser import chromium, needs_chromium
from tests.unit.app.replay.drive import drive, write_log

pytestmark = [pytest.mark.stack, needs_chromium]
PHONE, DESK = (360, 740), (1280, 900)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("drive")
    write_log(folder / "a.mcap", drive(130), folder / "secrets")
    return write_report([folder / "a.mcap"], None, AtHand())


@pytest.mark.parametrize("size", [PHONE, DESK])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_fits_asks_no_host_and_passes_axe(
    browser: Any, report: Path, size: tuple[int, int], scheme: str
) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page = browser.new_page(viewport={"width": size[0], "height": size[1]}, color_scheme=scheme)
    asked: list[str] = []
    said: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: said.append(message.text))
    page.goto(report.as_uri())
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []
    assert said == []
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    found = axe.run(page).response["violations"]
    assert [(each["id"], each["nodes"][0]["html"][:120]) for each in found] == []
    page.close()


def test_a_mark_of_the_timeline_leads_to_its_message_and_the_page_prints(browser: Any, report: Path) -> None:
    page = browser.new_page(viewport={"width": DESK[0], "height": DESK[1]})
    page.goto(report.as_uri())
    page.locator("svg a circle").first.click()
    assert "#tick-" in page.url
    assert page.locator("article:target").is_visible()
    assert page.pdf()[:5] == b"%PDF-"
    page.close()

"""The site of the pages: it builds, a broken link ends the build, its search finds, and it asks no other host."""

import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from drivemcp.testing import serving
from tests.browser import chromium, needs_chromium

pytest.importorskip("mkdocs", reason="mkdocs is not installed (pip install 'drivemcp[docs]')")
ROOT = Path(__file__).parents[3]


class Quiet(SimpleHTTPRequestHandler):
    """Logs no request."""

    def log_message(self, *_: object) -> None:
        pass


def build(config: Path, site: Path) -> subprocess.CompletedProcess[str]:
    command = [
        sys.executable,
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "--config-file",
        str(config),
        "--site-dir",
        str(site),
    ]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120, cwd=ROOT)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    built = build(ROOT / "mkdocs.yml", folder)
    assert built.returncode == 0, built.stderr
    return folder


@pytest.fixture
def address(site: Path) -> Iterator[str]:
    with serving(ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(site)))) as server:
        yield f"http://127.0.0.1:{server.server_address[1]}/"


def test_every_page_is_in_the_site(site: Path) -> None:
    pages = {path.relative_to(ROOT / "docs").with_suffix(".html") for path in (ROOT / "docs").rglob("*.md")}
    assert {path for path in pages if not (site / path).is_file()} == set()


@pytest.mark.parametrize("link", ["[gone](gone.md)", "[no such heading](#gone)", "![gone](gone.png)"])
def test_a_broken_link_ends_the_build(tmp_path: Path, link: str) -> None:
    config = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    (tmp_path / "mkdocs.yml").write_text(config.replace("scripts/", f"{ROOT}/scripts/"), encoding="utf-8")
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "index.md").write_text(f"# Page\n\n{link}\n", encoding="utf-8")
    built = build(tmp_path / "mkdocs.yml", tmp_path / "site")
    assert built.returncode == 1
    assert "gone" in built.stderr


def test_a_link_out_of_the_docs_becomes_the_files_path(site: Path) -> None:
    page = (site / "tutorial" / "your-first-tool.html").read_text(encoding="utf-8")
    assert "<code>examples/roadworks</code>" in page
    assert 'href="../../examples' not in page


@needs_chromium
def test_its_search_finds_and_no_other_host_is_asked(address: str) -> None:
    with chromium() as browser:
        page = browser.new_page()
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        page.goto(address)
        page.fill("input.md-search__input", "hash chain")
        page.wait_for_selector("article.md-search-result__article")
        page.goto(f"{address}explanation/safety.html")
        page.wait_for_load_state("networkidle")
    assert asked
    assert [url for url in asked if not url.startswith((address, "blob:", "data:"))] == []


def test_every_tab_has_a_name(site: Path) -> None:
    assert ">None<" not in " ".join((site / "index.html").read_text(encoding="utf-8").split()).replace(
        "> ", ">"
    ).replace(" <", "<")

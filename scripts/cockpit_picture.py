"""Writes the picture of the cockpit's page from a drive: `python scripts/cockpit_picture.py`. It needs Chromium and Playwright."""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np

ROOT = Path(__file__).parents[1]
PICTURE = ROOT / "docs" / "images" / "cockpit.png"
DRIVE = ("--scenario", "urb-rain", "--seconds", "40", "--seed", "7", "--lockstep", "--headless")
SCREENS = (("light", 360), ("dark", 1024))
"""A phone by day and a head unit by night: colour scheme and width (px)."""
HEIGHT_PX, BETWEEN_PX = 640, 16
SPOKEN_MS = 60_000


def photographed(address: str) -> np.ndarray:
    """Both screens side by side, each with a limit ahead on it. Raises playwright's TimeoutError where none is spoken in time."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        pages = [_open(browser, address, scheme, width) for scheme, width in SCREENS]
        pages[1].locator("#words", has_text="ahead").wait_for(timeout=SPOKEN_MS)
        shots = [cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_COLOR) for page in pages]
        browser.close()
    gap = np.full((HEIGHT_PX, BETWEEN_PX, 3), 255, np.uint8)
    return np.concatenate([shots[0], gap, shots[1]], axis=1)


def _open(browser: Any, address: str, scheme: str, width_px: int) -> Any:
    page = browser.new_page(viewport={"width": width_px, "height": HEIGHT_PX}, color_scheme=scheme)
    page.goto(address)
    return page


def main() -> int:
    """Drive, photograph, write."""
    with tempfile.TemporaryDirectory() as out:
        command = [sys.executable, "-m", "drivemcp.cli", "up", *DRIVE, "--out", out]
        with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as drive:
            assert drive.stderr is not None
            for line in drive.stderr:
                if found := re.match(r"cockpit: (\S+)", line):
                    cv2.imwrite(str(PICTURE), photographed(found[1]))
                    drive.terminate()
    sys.stdout.write(f"{PICTURE}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

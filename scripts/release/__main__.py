"""`python -m scripts.release`: distributions, tried on each Python that is here, bills of materials, images, notes, checksums; no upload.

Exit status: 0 made, 1 refused or failed.
"""

import argparse
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))

from scripts.release import bills, checks, environments, images  # noqa: E402

TOOLS = ("build==1.6.1", "cyclonedx-bom==7.5.0")
SUMS = "SHA256SUMS"


def main(arguments: Sequence[str] | None = None) -> int:
    """Make it."""
    flags = _flags(arguments)
    for reason in (reasons := list(checks.refusals(ROOT))):
        say(f"{'would be refused' if flags.rehearse else 'refused'}: {reason}")
    if reasons and not flags.rehearse:
        return 1
    os.chdir(ROOT)
    out = Path(flags.out).resolve()
    if not checks.may_be_emptied(out, ROOT, SUMS):
        say(f"refused: {out} holds what no release made, and would be deleted; name another folder")
        return 1
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    try:
        with tempfile.TemporaryDirectory(prefix="drivemcp-release-") as folder:
            make(out, Path(folder), flags.python or list(environments.VERSIONS), with_images=not flags.without_images)
    except (RuntimeError, subprocess.SubprocessError) as error:
        say(f"failed: {error}")
        return 1
    say(f"made: {out}; what is left to a maintainer: docs/how-to/release.md")
    return 0


def make(out: Path, folder: Path, versions: Sequence[str], *, with_images: bool) -> None:
    """Everything into `out`. Raises RuntimeError and SubprocessError."""
    version, stamp = checks.version_of(ROOT), checks.git(ROOT, "log", "-1", "--format=%ct")
    tools = environments.made(Path(sys.executable), folder / "tools").parent
    environments.run([tools / "pip", "install", "-q", *TOOLS], folder)
    os.environ["SOURCE_DATE_EPOCH"] = stamp
    environments.run([tools / "python", "-m", "build", "--outdir", out, ROOT], folder)
    environments.run([tools / "python", "-m", "build", "--wheel", "--outdir", out, ROOT / "evaluation"], folder)
    (wheel,) = out.glob("drivemcp-*.whl")
    (sdist,) = out.glob("drivemcp-*.tar.gz")
    _try(wheel, sdist, folder, versions)
    for extra in bills.SETS:
        say(bills.bill(extra, wheel, Path(sys.executable), tools, out, folder, stamp).name)
    environments.run([sys.executable, ROOT / "scripts" / "mcp_bundle.py", "--wheel", wheel, "--out", out], folder)
    shutil.copy(ROOT / "NOTICE", out)
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    (out / "notes.md").write_text(checks.notes(changelog, version) + "\n", encoding="utf-8")
    if with_images:
        _images(out, version)
    (out / SUMS).write_text("".join(f"{line}\n" for line in sums(out)), encoding="ascii")


def _try(wheel: Path, sdist: Path, folder: Path, versions: Sequence[str]) -> None:
    for version in versions:
        python = environments.interpreter(version)
        if python is None:
            say(f"Python {version}: not found here, not tried")
            continue
        for distribution in (wheel, sdist):
            told = environments.tried(version, python, distribution, folder / version, alone=distribution is sdist)
            say(
                f"Python {version}: {told.distribution} installed in {told.install_s:.0f} s, {told.ticks} ticks, log verified"
            )


def _images(out: Path, version: str) -> None:
    if reason := images.engine():
        say(f"images: no engine answers, none is built: {reason}")
        return
    compose = (ROOT / "docker-compose.yml").read_text(encoding="utf-8")
    pins = {name: images.pinned(image) for name, image in images.outside(compose, os.environ).items()}
    for name, image in images.unpinned(pins).items():
        say(f"images: {name}={image} has no digest: its registry does not answer; set {name}=NAME:TAG@sha256:DIGEST")
    (out / "pins.env").write_text("".join(f"{name}={image}\n" for name, image in pins.items()), encoding="ascii")
    images.build(
        ROOT, out, {**pins, "DRIVEMCP_VERSION": version, "DRIVEMCP_REVISION": checks.git(ROOT, "rev-parse", "HEAD")}
    )


def sums(folder: Path) -> Iterator[str]:
    """A line for each file, as `sha256sum --check` reads them."""
    for file in sorted(path for path in folder.iterdir() if path.is_file() and path.name != SUMS):
        yield f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}"


def say(text: str) -> None:
    """One line, at once."""
    sys.stdout.write(f"release: {text}\n")
    sys.stdout.flush()


def _flags(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default="dist", help="folder; what it holds is deleted")
    parser.add_argument(
        "--python", action="append", choices=environments.VERSIONS, help="try this one alone; more than once"
    )
    parser.add_argument("--without-images", action="store_true", help="though an engine answers")
    parser.add_argument("--rehearse", action="store_true", help="go on where a release would be refused")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())

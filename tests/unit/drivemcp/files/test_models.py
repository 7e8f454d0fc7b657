"""Named models: fetched from a server on this machine, verified before their name exists."""

import hashlib
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import msgspec
import pytest

from drivemcp.cli import run
from drivemcp.errors import UserError
from drivemcp.files.fetching import assemble, check_address, fetch
from drivemcp.files.models import ModelRow, find_model, load_table, path_of, state_of
from drivemcp.testing import serving

CONTENT = bytes(range(256)) * 2000


class Publisher(ThreadingHTTPServer):
    """Serves CONTENT at /model.onnx, as far as `cut_at` and with ranges if `ranges`."""

    daemon_threads = True
    cut_at: int | None = None
    ranges = True
    content = CONTENT

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Page)
        self.asked: list[str] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/model.onnx"


class Page(BaseHTTPRequestHandler):
    """One request."""

    server: Publisher

    def do_GET(self) -> None:
        wanted = self.headers.get("Range", "")
        self.server.asked.append(wanted)
        if self.path == "/away":
            self.send_response(302)
            self.send_header("Location", "http://models.example.org/model.onnx")
            self.end_headers()
            return
        if self.path != "/model.onnx":
            self.send_error(404)
            return
        start = int(wanted[len("bytes=") : -1]) if wanted and self.server.ranges else 0
        body = self.server.content[start:]
        self.send_response(206 if start else 200)
        if start:
            self.send_header(
                "Content-Range", f"bytes {start}-{len(self.server.content) - 1}/{len(self.server.content)}"
            )
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body[: self.server.cut_at])

    def log_message(self, format: str, *args: object) -> None:
        """Silent."""


@pytest.fixture
def publisher() -> Iterator[Publisher]:
    with serving(Publisher()) as server:
        yield server


@pytest.fixture
def folder(tmp_path: Path, publisher: Publisher, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's model folder, with a table of one model that the local server publishes."""
    (tmp_path / "table.toml").write_text(
        f'[local]\nfile = "local.onnx"\npublisher = "a test"\nlicence = "CC0-1.0"\nurl = "{publisher.url}"\n'
        f'sha256 = "{hashlib.sha256(CONTENT).hexdigest()}"\nsize_bytes = {len(CONTENT)}\ninput = "none"\nclasses = "none"\n'
        'good_for = "a test"\n'
    )
    monkeypatch.setenv("DRIVEMCP_MODELS", str(tmp_path))
    return tmp_path


def local(folder: Path) -> ModelRow:
    return load_table(folder)["local"]


def test_a_pulled_model_is_found_by_its_name_and_verifies(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(UserError, match="not here yet; fetch it with: drivemcp models pull local"):
        find_model("local")
    assert run(["models", "pull", "local"]) == 0
    assert "CC0-1.0" in capsys.readouterr().err, "the licence is shown"
    assert find_model("local").read_bytes() == CONTENT
    assert run(["models", "verify", "local"]) == 0
    assert run(["models", "pull", "local"]) == 0
    assert "here already, verified" in capsys.readouterr().err


def test_a_transfer_that_breaks_off_goes_on_where_it_stopped(folder: Path, publisher: Publisher) -> None:
    row, target = local(folder), folder / "local.onnx"
    publisher.cut_at = 300_000
    with pytest.raises(UserError, match="pull again to go on where it stopped"):
        fetch(row, target)
    assert not target.exists()
    publisher.cut_at = None
    seen: list[int] = []
    fetch(row, target, lambda done, total: seen.append(done))
    assert target.read_bytes() == CONTENT
    assert seen[0] > 0
    assert publisher.asked[-1] == f"bytes={seen[0]}-"


def test_a_publisher_without_ranges_is_read_from_the_start(folder: Path, publisher: Publisher) -> None:
    publisher.ranges = False
    (folder / "local.onnx.part").write_bytes(CONTENT[:1000])
    fetch(local(folder), folder / "local.onnx")
    assert (folder / "local.onnx").read_bytes() == CONTENT


@pytest.mark.parametrize("content", [CONTENT[:-1] + b"!", CONTENT + b"!", b"<html>" + CONTENT[6:]])
def test_a_wrong_file_never_gets_the_name(folder: Path, publisher: Publisher, content: bytes) -> None:
    publisher.content = content
    with pytest.raises(UserError, match=r"checksum of .* differs .*; nothing was kept"):
        fetch(local(folder), folder / "local.onnx")
    assert sorted(path.name for path in folder.iterdir()) == ["table.toml"]


def test_a_rotten_beginning_is_thrown_away_and_the_next_pull_starts_anew(folder: Path, publisher: Publisher) -> None:
    (folder / "local.onnx.part").write_bytes(b"rot" * 100)
    with pytest.raises(UserError, match="nothing was kept"):
        fetch(local(folder), folder / "local.onnx")
    fetch(local(folder), folder / "local.onnx")
    assert state_of(local(folder), folder) == "whole"


def test_without_a_network_one_line_says_what_to_do(
    folder: Path, publisher: Publisher, capsys: pytest.CaptureFixture[str]
) -> None:
    publisher.server_close()
    publisher.shutdown()
    assert run(["models", "pull", "local"]) == 2
    complaint = capsys.readouterr().err.splitlines()[-1]
    assert "bring the file to" in complaint
    assert str(folder / "local.onnx") in complaint


def test_a_changed_file_fails_verification_and_is_not_used(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "local.onnx").write_bytes(CONTENT[:-1] + b"!")
    assert run(["models", "verify"]) == 1
    assert "local: here, CHECKSUM DIFFERS" in capsys.readouterr().out
    with pytest.raises(UserError, match="not what its checksum says"):
        find_model("local")


@pytest.mark.parametrize(
    "url", ["http://models.example.org/m.onnx", "ftp://127.0.0.1/m", "file:///etc/passwd", "https://", "m"]
)
def test_only_https_or_this_machine_is_asked(url: str) -> None:
    with pytest.raises(UserError, match="https"):
        check_address(url)


def test_a_redirect_to_plain_http_elsewhere_is_not_followed(folder: Path, publisher: Publisher) -> None:
    row = ModelRow(
        file="local.onnx", publisher="", licence="", good_for="", input="", classes="", sha256="0" * 64, size_bytes=9,
        url=publisher.url.replace("/model.onnx", "/away"),
    )  # fmt: skip
    with pytest.raises(UserError, match="fetched over https"):
        fetch(row, folder / "local.onnx")


def test_the_table_lists_licences_and_our_own_models_verify(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["models", "list"]) == 0
    listed = capsys.readouterr().out
    assert listed.startswith("yolox-nano  [not here]  Apache-2.0, Megvii")
    for name, row in load_table(folder).items():
        assert row.licence
        assert row.shipped or (
            len(row.sha256) == 64
            and row.size_bytes
            and (name == "local" or row.package or row.url.startswith("https://"))
        )
    assert run(["models", "verify", "detector"]) == 0
    assert run(["models", "verify", "reader"]) == 0


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ('file = "../evil.onnx"', "file"),
        ('file = "detector.onnx"', "another model's file"),
        ('file = "own.onnx"\nsize = 4', "size"),
        ('file = "own.onnx"', "needs url, sha256 and size_bytes"),
    ],
)
def test_a_bad_row_of_the_users_own_table_is_named(tmp_path: Path, line: str, complaint: str) -> None:
    (tmp_path / "table.toml").write_text(
        f'[own]\n{line}\npublisher = ""\nlicence = ""\ninput = ""\nclasses = ""\ngood_for = ""\n'
    )
    with pytest.raises(UserError, match=complaint):
        load_table(tmp_path)


def test_an_unknown_name_lists_the_known_ones(folder: Path) -> None:
    with pytest.raises(UserError, match="the names are yolox-nano"):
        find_model("yolo-nonsense")


def test_the_file_of_a_name_lies_in_the_users_folder(folder: Path) -> None:
    assert path_of(load_table(folder)["yolox-nano"], folder) == folder / "yolox_nano.onnx"


WEIGHTS = b"weights" * 1000
PACKAGE = f"""
from pathlib import Path

def assemble(output_path, overwrite=False):
    Path(output_path).write_bytes({WEIGHTS!r})
"""


def test_weights_with_terms_come_from_their_package_once_the_terms_are_accepted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "some_weights.py").write_text(PACKAGE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("DRIVEMCP_MODELS", str(tmp_path / "models"))
    row = ModelRow(
        file="some.gguf", publisher="p", licence="Some Terms", good_for="", input="", classes="", package="some_weights",
        extra="language-model", terms="https://example.org/terms", sha256=hashlib.sha256(WEIGHTS).hexdigest(), size_bytes=len(WEIGHTS),
    )  # fmt: skip
    monkeypatch.setattr("drivemcp.commands.models.load_table", lambda _: {"some": row})
    assert run(["models", "pull", "some"]) == 2
    told = capsys.readouterr().err
    assert "Some Terms" in told
    assert "read https://example.org/terms, then: drivemcp models pull some --accept-terms" in told
    assert not path_of(row, tmp_path / "models").exists()
    assert run(["models", "pull", "some", "--accept-terms"]) == 0
    assert state_of(row, tmp_path / "models") == "whole"
    damaged = msgspec.structs.replace(row, sha256="0" * 64)
    with pytest.raises(UserError, match="checksum of some_weights differs"):
        assemble(damaged, tmp_path / "again.gguf")
    with pytest.raises(UserError, match=r"comes with the package 'no_such'.*drivemcp\[language-model\]"):
        assemble(msgspec.structs.replace(row, package="no_such"), tmp_path / "again.gguf")
    assert not (tmp_path / "again.gguf").exists()

"""One run, really driven: what it leaves, and that it is never driven twice."""

from pathlib import Path

import msgspec
import pytest

from drivemcp.cli import run
from drivemcp.errors import UserError
from evaluation.campaign import one
from evaluation.campaign.one import run_one
from evaluation.campaign.plan import placed, rows_of
from evaluation.campaign.store import LOG, METRICS, Kept, Store
from evaluation.metrics import TRUTH_FILE
from evaluation.run.ready import RunError
from evaluation.run.recorded import record_of
from evaluation.run.spec import RunSpec
from services.logger.verification.verifier import verify

(ROW,) = (row for row in rows_of("results", "rendered") if row.key == "dynamic-vsl/DriveMCP")
SPEC = placed(ROW, 0, 1.5)


def never(*_: object) -> None:
    raise AssertionError("driven again")


def test_a_run_is_kept_measured_again_and_never_driven_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    key = Store(tmp_path).key(SPEC)
    assert Store(tmp_path).kept(key) is None
    driven = run_one(str(tmp_path), key, SPEC)
    folder = tmp_path / key
    assert Store(tmp_path).kept(key) == msgspec.json.decode(msgspec.json.encode(driven), type=Kept)
    assert driven.metrics["seconds"] == pytest.approx(1.5, abs=0.11)
    assert msgspec.json.decode((folder / "spec.json").read_bytes(), type=RunSpec) == SPEC
    assert verify(folder / LOG).intact
    assert run(["replay", str(folder / LOG)]) == 0
    assert not list(folder.glob("**/*.pem")), "no private key stays"

    monkeypatch.setattr(one, "drive", never)
    (folder / METRICS).write_bytes(msgspec.json.encode(msgspec.structs.replace(driven, measured_by="another code")))
    assert Store(tmp_path).kept(key) is None, "measured by other code"
    again = run_one(str(tmp_path), key, SPEC)
    assert again == driven

    (folder / METRICS).write_bytes((folder / METRICS).read_bytes()[:100])
    cut = run_one(str(tmp_path), key, SPEC)
    lost = msgspec.structs.replace(driven, wall_s=0.0, cpu_s=0.0, machine="")
    assert cut == lost, "how long it took, and on what, is lost; the run is not"
    (folder / METRICS).unlink()
    (alone := tmp_path / "alone").mkdir()
    (alone / LOG).write_bytes((folder / LOG).read_bytes())
    with pytest.raises(UserError, match=rf"alone/{LOG}: the truth of its run is not beside it"):
        record_of(alone / LOG)
    whole = (folder / LOG).read_bytes()
    (folder / LOG).write_bytes(whole[: len(whole) // 2])
    with pytest.raises(RunError, match=f"{key}: what was logged is damaged .*is not as it was written"):
        run_one(str(tmp_path), key, SPEC)
    (folder / LOG).write_bytes(whole)
    (truth := folder / TRUTH_FILE).write_bytes(truth.read_bytes()[:-20])
    with pytest.raises(RunError, match=f"{key}: what was logged is damaged .*delete the folder to drive it again"):
        run_one(str(tmp_path), key, SPEC)
    truth.unlink()
    with pytest.raises(AssertionError, match="driven again"):
        run_one(str(tmp_path), key, SPEC)


def test_an_unfinished_run_is_none_and_a_failure_is_noted_until_it_is_mended(tmp_path: Path) -> None:
    store = Store(tmp_path)
    part = store.start("a")
    (part / METRICS).write_text("{}", encoding="utf-8")
    for name in (LOG, TRUTH_FILE):
        (part / name).touch()
    assert not store.driven("a"), "its folder has no name yet"
    store.note("a", "its process ended with 9")
    assert store.failed("a") == "its process ended with 9"
    store.finish("a")
    store.note("a", "")
    assert store.driven("a")
    assert store.failed("a") == ""
    assert store.kept("a") is None, "what cannot be read counts as not measured"


def test_a_run_in_which_a_service_failed_is_no_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def drive(*_: object) -> None:
        import logging

        logging.getLogger("drivemcp.perception").error("perception: handling a picture failed")

    monkeypatch.setattr(one, "drive", drive)
    with pytest.raises(RunError, match="1 errors in services, the first: perception: handling a picture failed"):
        run_one(str(tmp_path), "a", SPEC)
    assert not Store(tmp_path).driven("a")


def test_two_evaluations_do_not_drive_into_one_folder(tmp_path: Path) -> None:
    with Store(tmp_path).alone(), pytest.raises(UserError, match="another evaluation"), Store(tmp_path).alone():
        pass
    with Store(tmp_path).alone():
        pass
    (tmp_path / "file").touch()
    with pytest.raises(UserError, match=r"runs cannot go into .*: Not a directory"), Store(tmp_path / "file/x").alone():
        pass

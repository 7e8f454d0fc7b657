"""A digest of code: of packages that are there."""

from pathlib import Path

import pytest

from drivemcp.runtime.codehash import code_hash


@pytest.mark.parametrize("name", ["no_such_package", "services.no_such_service", "drivemcp.runtime.codehash"])
def test_what_is_no_package_has_no_digest_instead_of_one_of_nothing(name: str) -> None:
    with pytest.raises(ModuleNotFoundError, match=name.split(".")[-1]):
        code_hash("proto", name)


def test_settings_that_lie_beside_the_code_are_part_of_its_digest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "some_service").mkdir()
    (tmp_path / "some_service" / "__init__.py").touch()
    (settings := tmp_path / "some_service" / "lambda.json").write_text("1", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    before = code_hash("some_service")
    settings.write_text("2", encoding="utf-8")
    code_hash.cache_clear()
    assert code_hash("some_service") != before

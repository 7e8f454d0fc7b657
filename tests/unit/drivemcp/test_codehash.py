"""A digest of code: of packages that are there."""

import pytest

from drivemcp.codehash import code_hash


@pytest.mark.parametrize("name", ["no_such_package", "services.no_such_service", "drivemcp.codehash"])
def test_what_is_no_package_has_no_digest_instead_of_one_of_nothing(name: str) -> None:
    with pytest.raises(ModuleNotFoundError, match=name.split(".")[-1]):
        code_hash("proto", name)

"""`python -m evaluation.corruption SERVICE SPEC [--config FILE ...]`: a service, its publications corrupted."""

import sys

from drivemcp.errors import UserError
from drivemcp.registry import load_service
from drivemcp.service import main
from evaluation.corruption.hosted import hosted
from evaluation.corruption.spec import read_spec


def run(arguments: list[str]) -> None:
    """Run and exit as the service itself would; 2 on a user's mistake."""
    try:
        if len(arguments) < 2:
            raise UserError("usage: python -m evaluation.corruption SERVICE SPEC [the service's own flags]")
        service = hosted(load_service(arguments[0]), read_spec(arguments[1]))
    except UserError as error:
        sys.stderr.write(f"evaluation.corruption: {error}\n")
        sys.exit(2)
    main(service, arguments[2:])


if __name__ == "__main__":
    run(sys.argv[1:])

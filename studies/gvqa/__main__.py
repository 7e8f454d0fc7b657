"""`python -m studies gvqa PREDICTIONS.json REFERENCE.json`."""

import sys

try:
    from studies.gvqa.command import main
except ModuleNotFoundError as error:
    sys.exit(f"studies.gvqa: {error.name} is not installed; it comes with the extra gvqa")

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

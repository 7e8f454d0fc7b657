"""`python -m evaluation.gvqa PREDICTIONS.json REFERENCE.json`."""

import sys

try:
    from evaluation.gvqa.command import main
except ModuleNotFoundError as error:
    sys.exit(f"evaluation.gvqa: {error.name} is not installed; it comes with the extra gvqa")

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

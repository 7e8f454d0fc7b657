"""`python -m studies NAME ...`: without a name, lists what there is."""

import sys

import studies
from training.runner import run

if __name__ == "__main__":
    sys.exit(run(studies, sys.argv[1:]))

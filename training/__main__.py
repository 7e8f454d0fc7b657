"""`python -m training NAME ...`: without a name, lists what there is."""

import sys

import training
from training.runner import run

if __name__ == "__main__":
    sys.exit(run(training, sys.argv[1:]))

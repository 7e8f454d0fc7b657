"""`python -m studies openloop LOG...`: every method on the snapshots of the same runs, as a table."""

import sys

from studies.openloop.table import main

if __name__ == "__main__":
    sys.exit(main())

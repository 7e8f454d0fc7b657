"""Where test data of others lies: beside the checkout, or where `DRIVEMCP_SHARED` says."""

import os
from pathlib import Path

ROOT = Path(__file__).parents[1]
SHARED = Path(os.environ.get("DRIVEMCP_SHARED", ROOT.parent / "shared"))

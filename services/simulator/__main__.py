"""`python -m services.simulator`."""

from drivemcp.service import main
from services.simulator.service import SERVICE

main(SERVICE)

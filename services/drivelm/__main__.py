"""`python -m services.drivelm`."""

from drivemcp.service import main
from services.drivelm.service import SERVICE

main(SERVICE)

"""The driver's page and the voice of the machine."""

from drivemcp.service import main
from services.cockpit.service import SERVICE

main(SERVICE)

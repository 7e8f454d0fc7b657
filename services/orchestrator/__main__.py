"""python -m services.orchestrator"""

from drivemcp.service import main
from services.orchestrator.service import SERVICE

main(SERVICE)

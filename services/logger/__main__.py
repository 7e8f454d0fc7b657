"""`python -m services.logger`"""

from drivemcp.service import main
from services.logger.service import SERVICE

main(SERVICE)

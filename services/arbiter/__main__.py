"""python -m services.arbiter"""

from drivemcp.service import main
from services.arbiter.service import SERVICE

main(SERVICE)

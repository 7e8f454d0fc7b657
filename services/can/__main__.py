from drivemcp.service import main
from services.can.service import SERVICE

main(SERVICE)

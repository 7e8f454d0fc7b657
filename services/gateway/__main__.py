from drivemcp.service import main
from services.gateway.service import SERVICE

main(SERVICE)

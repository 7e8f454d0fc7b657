from drivemcp.service import main
from drivemcp_roadworks.service import SERVICE

main(SERVICE)

from drivemcp.service import main
from services.rules.service import SERVICE

main(SERVICE)

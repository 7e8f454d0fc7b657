from drivemcp.service import main
from services.player.service import SERVICE

main(SERVICE)

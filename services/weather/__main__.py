from drivemcp.service import main
from services.weather.service import SERVICE

main(SERVICE)

from drivemcp.service import main
from services.retrieval.service import SERVICE

main(SERVICE)

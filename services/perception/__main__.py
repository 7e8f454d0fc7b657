"""`python -m services.perception`."""

from drivemcp.service import main
from services.perception.service import SERVICE

if __name__ == "__main__":
    main(SERVICE)

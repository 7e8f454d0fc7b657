"""The other vehicles: traffic around the ego, and cross traffic with right of way."""

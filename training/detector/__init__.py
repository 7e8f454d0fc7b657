"""The detector of road users and signs: its network, how it is trained, scored and reduced to eight bits."""

"""The bus: Zenoh sessions and access control, inboxes, lockstep and the health of topics."""

"""The orchestrator: one tick from what is seen to what is said."""

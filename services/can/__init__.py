"""The CAN service: frames of a vehicle bus turned into curated signals, health and diagnostics."""

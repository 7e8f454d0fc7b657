"""Recorded CAN logs, read by python-can: one reader for the CAN service and for recordings."""

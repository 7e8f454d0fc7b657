"""Requests to control units and their answers: OBD and UDS over ISO-TP, and what may be sent at all. Twelve modules: one protocol each."""

"""Requests to control units and their answers: OBD and UDS over ISO-TP, and what may be sent at all. Eleven modules: one protocol each."""

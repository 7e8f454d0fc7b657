"""Populations of drivers at hazards and on routes: what the guard avoids for each, and what it does unasked."""

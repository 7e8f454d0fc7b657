"""The Direct methods: the front end answers one prompt for each event; no tools, no fusion, no arbiter."""

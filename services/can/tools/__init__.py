"""The tools of the MCP-CAN catalogue: what they ask, send and disclose."""

"""The MCP face of the running system: every tool on the bus to any MCP client."""

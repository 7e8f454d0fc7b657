"""What a desktop client starts: `drivemcp mcp` with the options that were filled in."""

import os

from drivemcp.cli import main

OPTIONS = ("tools", "connect", "vehicle", "grant")


def filled_in() -> list[str]:
    """The options whose variable holds something; one that the client left as its placeholder is empty."""
    given = {option: os.environ.get(f"DRIVEMCP_MCP_{option.upper()}", "").strip() for option in OPTIONS}
    return [
        word
        for option, value in given.items()
        if value and not value.startswith("${")
        for word in (f"--{option}", value)
    ]


if __name__ == "__main__":
    main(["mcp", *filled_in()])

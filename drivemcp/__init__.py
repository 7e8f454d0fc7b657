"""What every service shares: bus, tools, runner, configuration, clock, data paths, command line, testing helpers."""

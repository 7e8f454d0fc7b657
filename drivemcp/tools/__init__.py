"""Tools: defined by typed functions, served and called over the bus."""

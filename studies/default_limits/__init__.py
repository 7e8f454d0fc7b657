"""The rulepacks against the world's table of default limits, which is fetched by its user and is no part of this project."""

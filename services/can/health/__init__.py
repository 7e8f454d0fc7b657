"""The car's health: sensors checked against each other, indicators, trends and degradation."""

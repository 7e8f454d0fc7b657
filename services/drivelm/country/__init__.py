"""The belief about the country, from signs and oncoming traffic."""

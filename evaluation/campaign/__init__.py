"""A campaign of runs: what is to be driven, driving it side by side, and the store of finished runs."""

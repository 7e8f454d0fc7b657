"""Pages of `docs/reference/` made from the tables and structs of the code: `python -m scripts.reference`."""

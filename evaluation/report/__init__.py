"""The report: HTML page, page of the docs, plots."""

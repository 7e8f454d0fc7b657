"""The paper's tables from finished runs."""

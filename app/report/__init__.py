"""The report of a drive: one page that a person reads afterwards and an auditor trusts."""

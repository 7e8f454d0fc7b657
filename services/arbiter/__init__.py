"""The safety arbiter: SILENT, SPEAK or ACT, by stated numbers and its own look at the road."""

"""The methods that DriveMCP is compared with: advisors and judges, found by entry point and refused outside simulation."""

"""The live view: a process of its own draws the drive with Rerun; the logger only hands it records and never waits."""

"""From arriving records to sealed log files, without waiting for a disk."""

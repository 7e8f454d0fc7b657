"""Every method on the same recorded snapshots."""

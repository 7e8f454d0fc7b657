"""What calls take on a machine."""

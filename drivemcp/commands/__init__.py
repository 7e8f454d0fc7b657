"""Commands of the runtime's own layer."""

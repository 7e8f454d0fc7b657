"""The roadworks expert."""

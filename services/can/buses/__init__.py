"""Ways to a bus: carried frames, adapters, recordings, and the last frames of each."""

"""The machine's voice: tones, words, and what may cut them off."""

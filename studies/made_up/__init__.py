"""What a model makes up in its answers to whole prompts, and whether it heeds the scene at all."""

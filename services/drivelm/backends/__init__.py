"""Backends beside the embedded one: a local checkpoint, a chat endpoint, and what makes slow ones harmless."""

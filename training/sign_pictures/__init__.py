"""Pictures of signs and lights as the reader may meet them: faces, fonts, backgrounds, wear, and whole avenues."""

"""The scene as DriveLM's graph: nodes, questions, answers, and DriveLM's file format."""

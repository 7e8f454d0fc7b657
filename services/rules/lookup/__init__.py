"""A driver's question: answers from retrieved passages, and evidence for typed answers."""

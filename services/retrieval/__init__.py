"""Finds the passages of the rulepacks that speak to a question: BM25 and, where an encoder is there, cosine."""

"""Text as vectors: encoders, embeddings, question vectors and reranking."""

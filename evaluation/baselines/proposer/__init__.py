"""A proposer in place of our fusion: the experts answer as under fusion, and the answer to one prompt is the advice."""

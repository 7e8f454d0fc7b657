"""A proposer in place of our fusion: the experts answer as ever, and a whole prompt with their answers is what advice is made of."""

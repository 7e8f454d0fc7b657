"""The second look at people: crops, network, training."""

"""The second look at the boxes of a class: crops, network, training."""

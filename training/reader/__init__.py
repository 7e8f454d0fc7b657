"""The reader of signs and lights: samples, network, training, scores."""

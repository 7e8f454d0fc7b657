"""One run of the evaluation: a scenario driven in lockstep through the services of production, in one process."""

"""What calls and pictures take on this machine, measured; runs in lockstep can take their modelled latencies from it."""

from evaluation.latencies.measured import Latencies, Took, read

__all__ = ["Latencies", "Took", "read"]

"""What a tick gets to see: inputs, how long they count, the ego's motion, a clock that was set back."""

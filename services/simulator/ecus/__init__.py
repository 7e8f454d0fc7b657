"""The car's control units on its bus: CAN frames and answers to diagnostic requests."""

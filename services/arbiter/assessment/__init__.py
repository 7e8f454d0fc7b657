"""What the arbiter reads itself, and the numbers that a decision rests on."""

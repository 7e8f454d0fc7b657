"""What must hold before the arbiter warns or brakes by itself, and the bounds of braking."""

"""The physics: water, frost, friction, grip, slip, sight and wind."""

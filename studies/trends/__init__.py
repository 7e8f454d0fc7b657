"""How trends do on long drives: alarms in sound ones, and how long before the lamp a leak is told."""

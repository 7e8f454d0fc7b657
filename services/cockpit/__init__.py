"""The driver's page, and the voice of the machine: the limit as a sign, the speed, one line of advice."""

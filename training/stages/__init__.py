"""Random scenes for training and testing: a road, its signs and its road users, composed by a seed."""

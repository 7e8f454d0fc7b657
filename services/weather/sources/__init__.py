"""Weather services on the internet: each one a `Provider`, each answer an `Observation` that only ever warns."""

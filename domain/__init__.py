"""What several services mean by the same words: road users, kinematics, RSS, units. Pure; imports `proto` alone."""

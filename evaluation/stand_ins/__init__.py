"""What is published in place of what services perceive: truth for the Oracle, a sound car for the ablation of CAN."""

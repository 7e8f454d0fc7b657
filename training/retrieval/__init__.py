"""What retrieval is tuned on: labelled questions, and the choice of lambda."""

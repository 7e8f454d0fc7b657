"""What is known of a car: its bus descriptions, the curated fields, and the profile that feeds one from the other."""

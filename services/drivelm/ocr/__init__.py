"""Character recognition for names on town signs and numbers on plates."""

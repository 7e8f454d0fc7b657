"""What the reader makes of photographed signs that others published (GTSRB, GTSDB)."""

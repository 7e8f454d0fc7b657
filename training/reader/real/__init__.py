"""Crops of photographs for the reader, and what it makes of the tracks that training leaves out."""

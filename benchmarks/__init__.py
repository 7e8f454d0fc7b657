"""Ours beside what one would pick instead, in one run on one machine. `make bench`"""

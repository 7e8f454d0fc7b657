"""Checks on pictures, stamps and boxes before anything is concluded from them."""

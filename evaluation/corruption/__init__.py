"""Seeded corruption between the sensors and `world_state`: what is missed, misread, lost, dark, frozen or late.

Flat: each module is one kind of corruption, or one step of corrupting.
"""

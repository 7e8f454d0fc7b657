"""Recorded logs as tools tell of them: which there are, what one holds, and one signal over its time."""

"""Marks within the text of a statute: formulas, raised text, numbers of lists."""

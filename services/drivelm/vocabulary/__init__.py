"""The closed vocabulary of the front end: classes, sentences, the grammar, and the numbers that each country posts."""

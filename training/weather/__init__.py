"""The trees that judge a picture's weather."""

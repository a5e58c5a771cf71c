"""What the tyre is made of and what acts on it, one part a file."""

"""Camera files become a list of `Camera`."""

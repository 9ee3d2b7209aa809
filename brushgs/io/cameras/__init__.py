"""Camera files become a list of `Camera`: one file per format."""

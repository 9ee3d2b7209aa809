"""Pictures and videos in and out: one file per format."""

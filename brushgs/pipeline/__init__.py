"""From a scene file to a picture, numbered frames or a video: timed stages, in order."""

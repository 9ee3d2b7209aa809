"""A scene file becomes a picture, numbered frames or a video: the stages in order, each timed."""

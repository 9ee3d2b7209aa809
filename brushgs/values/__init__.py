"""The values that flow from step to step: frozen NumPy columns, checked once where they are made.

Conventions, used everywhere: quaternions are w, x, y, z; camera axes x right, y down, z forward; `viewmat`
takes world to camera on column vectors; the center of the pixel in row i and column j lies at (j + 0.5, i +
0.5); colors are display-encoded, as the scene was trained; angles are in radians, from +x towards +y.
"""

"""A painting as one HTML file that draws its strokes with WebGL2: no server, network or library."""

"""A painting as one HTML file, which draws its strokes by WebGL2: no server, no network, no library."""

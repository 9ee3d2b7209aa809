"""Which way strokes run: `orient` turns them within their own plane, see `orient.py`.

`planes` holds the mathematics of directions without a sign; `surface` and `neighborhood` find them in a
scene, `guides` and `marks` in what the user gives, which `open_field` reads.
"""

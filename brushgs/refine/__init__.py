"""Refinement: optimize strokes toward their scene or a style image; optional, on top of `autograd`.

    views -> target pictures -> fit (variables, drawing, losses) -> strokes

Everything here needs PyTorch, and a style image kornia (the extra [refine]); nothing else in brushgs does.
"""

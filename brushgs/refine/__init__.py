"""Strokes that come nearer to the scene they stand for, or to a style image: optional, on top of `autograd`.

    views -> what is to be seen there -> fit (variables, drawing, losses) -> strokes

Everything here needs PyTorch, the extra [refine]; nothing else in brushgs does.
"""

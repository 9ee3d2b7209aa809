"""These tests need PyTorch, which painting does not."""

import pytest

pytest.importorskip("torch", reason="brushgs.autograd needs PyTorch: pip install 'brushgs[refine]'")

"""These tests need PyTorch, which painting does not: without it they are skipped, but where it must be."""

import os

if os.environ.get("BRUSHGS_REQUIRE_WITNESS"):  # as .ci/run sets it: there a skip would prove nothing
    import torch  # noqa: F401

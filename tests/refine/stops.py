"""A fit that is stopped as by Ctrl-C."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from brushgs.refine import fit as fit_module


@contextmanager
def stopping_after(monkeypatch: pytest.MonkeyPatch, num_steps: int) -> Iterator[None]:
    """Every fit ends in a KeyboardInterrupt after so many steps."""
    step = fit_module.Fit._step

    def stop(fit):
        step(fit)
        if fit.step == num_steps:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(fit_module.Fit, "_step", stop)
        yield

"""The compiled core, `core`: the only place that imports it.

Ctrl-C during the module's setup would abort the process ("Critical nanobind error: ... KeyboardInterrupt"),
as nanobind cannot propagate exceptions there. It is deferred for these few milliseconds.
"""

from brushgs.core.signals import defer_stop

with defer_stop():
    import brushgs._core as core

__all__ = ["core"]

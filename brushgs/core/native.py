"""The compiled core, `core`: the one place that imports it.

Ctrl-C while its module is set up would abort the process ("Critical nanobind error: ... KeyboardInterrupt"),
because nanobind can pass on no exception there. It is deferred for these few milliseconds.
"""

from brushgs.core.signals import defer_stop

with defer_stop():
    import brushgs._core as core

__all__ = ["core"]

"""The machine and build of a measurement; a debug build is refused, since its times are meaningless."""

import platform
import re
from pathlib import Path
from typing import Any

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default


def describe_machine(num_threads: int | None = None) -> dict[str, Any]:
    """Compiler and instruction set of the core, Python, processor and threads.

    Raises:
        ValueError: if the core was built without optimization.
    """
    compiler, is_optimised = _core.build()
    if not is_optimised:
        raise ValueError(
            "bench: the core must be a release build, got a debug one; build it with CMAKE_BUILD_TYPE=Release"
        )
    return {
        "compiler": compiler,
        "isa": _core.isa(),
        "python": platform.python_version(),
        "processor": _processor(),
        "threads": num_threads_or_default(num_threads),
    }


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    names = re.findall(r"model name\s*:\s*(.+)", info.read_text()) if info.exists() else []
    return names[0] if names else platform.processor()

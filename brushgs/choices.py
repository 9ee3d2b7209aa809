"""The words that options take, and the presets: all that the help of the command line has to know.

Apart from `config` because dataclasses alone take longer to import than the rest of `brushgs --help`.
"""

from collections.abc import Mapping
from typing import Any, Literal

Weight = Literal["contribution", "paper"]
Features = Literal["balanced", "paper"]
Merge = Literal["cover", "paper"]
Method = Literal["auto", "minibatch", "lloyd"]
Filter = Literal["mip", "bilinear", "nearest"]
Extent = Literal["fitted", "paper"]

# Flags by name -> value. "paper" is the published method (Xiang et al. 2025) without its defects.
PRESETS: Mapping[str, Mapping[str, Any]] = {
    "default": {},
    "paper": {
        "weight": "paper",
        "features": "paper",
        "merge": "paper",
        "method": "minibatch",
        "filter": "bilinear",
        "extent": "paper",
    },
}

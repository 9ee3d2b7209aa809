"""Inputs of a refinement that are determined at run time: learning rates per stroke, and files of weights."""

from dataclasses import replace

import numpy as np

from brushgs.formats.files import is_plain
from brushgs.options.experiments import RefineConfig
from brushgs.pipeline.report import Report
from brushgs.pipeline.where import rows_where
from brushgs.values.arrays import F64
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians


def with_weights(config: RefineConfig, report: Report) -> RefineConfig:
    """The options with the weights file in use; the report names it with its hash."""
    if config.style is None:
        return config
    from brushgs.refine.style import weights_file
    from brushgs.refine.weights import hash_of

    found = weights_file(config.weights)
    if found is not None and is_plain(found):  # a missing file is refused by the reader
        report.tell(f"features of {found.name}, {hash_of(found)}")
    return replace(config, weights=found)


def rates_of_rows(strokes: Gaussians, view: FirstView, config: RefineConfig, report: Report) -> F64 | None:
    """[N] factors on the learning rates of strokes; None for 1. The first region with a stroke counts."""
    if not config.rated_regions:
        return None
    shares = np.ones(len(strokes))
    for rate, region in reversed(list(zip(config.region_rates, config.rated_regions, strict=True))):
        rows = rows_where(strokes, region, view, report, what=f"strokes at {rate.factor:g} of the rates")
        assert rows is not None, "there is a region"
        shares[rows] = rate.factor
    return shares

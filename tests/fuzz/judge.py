"""What reading an untrusted file may give: a sound value, or one sentence that names the file."""

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from brushgs import Camera, Gaussians, SceneWarning

LONGEST_SENTENCE = 1500  # characters beside the name of the file: a message must not be a flood


def judged(read: Callable[[Path], object], path: Path) -> str | None:
    """Read a file; the breach of the rules that this showed, or None.

    Refusals are ValueErrors (SceneError is one) of one printable line with the name of the file, warnings
    are SceneWarnings, and what comes back is finite. A RecursionError, MemoryError, KeyError ... is a fault.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            value = read(path)
        except ValueError as error:
            fault = _sentence_fault(str(error), path, type(error).__name__)
        except Exception as error:
            fault = f"{type(error).__name__} at {_place(error)}: {str(error)[:200]}"
        else:
            fault = _value_fault(value)
    for warning in caught:
        if fault is None and not issubclass(warning.category, SceneWarning):
            fault = f"{warning.category.__name__} at {Path(warning.filename).name}: {warning.message}"
        elif fault is None:
            fault = _sentence_fault(str(warning.message), path, warning.category.__name__)
    return fault


def _place(error: BaseException) -> str:
    """File and line where an error was raised."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return "?" if trace is None else f"{Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}"


def _sentence_fault(sentence: str, path: Path, kind: str) -> str | None:
    if str(path.parent) not in sentence:
        return f"{kind} without the name of the file: {sentence[:200]}"
    if len(sentence) > LONGEST_SENTENCE + len(str(path)):
        return f"{kind} of {len(sentence)} characters: {sentence[:200]}"
    if not sentence.isprintable():
        return f"{kind} that holds control characters: {sentence[:200]!r}"
    return None


def _value_fault(value: object) -> str | None:
    """A value that later steps could not trust."""
    if isinstance(value, Gaussians):
        is_sound = all(np.isfinite(column).all() for column in value.columns().values())
        return None if is_sound else "Gaussians that are not finite"
    if isinstance(value, np.ndarray):
        is_sound = np.isfinite(value).all() and value.min(initial=0) >= 0 and value.max(initial=0) <= 1
        return None if is_sound and value.size else "a picture with values outside 0 to 1, or none"
    if isinstance(value, Camera):
        is_sound = np.isfinite([*value.viewmat.ravel(), *value.K.ravel()]).all()
        is_sound &= max(value.width, value.height) < 1 << 16
        return None if is_sound else f"an unusable camera: {value}"
    if isinstance(value, list | tuple):
        return next((fault for fault in map(_value_fault, value) if fault), None)
    return None

"""Opens the stage of an untrusted USD file: layers that it names must lie in its folder."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pxr import Ar, Sdf, Usd

from brushgs.formats.usd.refused import RefusedError

_MAX_LAYERS = 1000
_MAX_PRIMS = 1_000_000


def open_stage(path: Path) -> Any:
    """The stage of a file.

    Raises:
        RefusedError: if it names files outside its folder, or very many.
        Tf.ErrorException: if it is damaged.
    """
    layer = Sdf.Layer.FindOrOpen(str(path.resolve()))
    if layer is None:
        raise RefusedError("is damaged, or no USD file; export it again")
    folder = path.resolve().parent
    pending, seen = [layer], {layer.identifier}
    while pending:
        layer = pending.pop()
        for name in layer.GetCompositionAssetDependencies():
            full = Sdf.ComputeAssetPathRelativeToLayer(layer, name)
            outer = Ar.SplitPackageRelativePathOuter(full)[0]
            if not Path(outer).resolve().is_relative_to(folder):
                fact = f"names the file {name[:100]!r}, which lies outside its folder"
                raise RefusedError(f"{fact}; put it beside this file, or export all in one file")
            found = Sdf.Layer.FindOrOpen(full) if full not in seen else None
            seen.add(full)
            if len(seen) > _MAX_LAYERS:
                raise RefusedError(f"must name at most {_MAX_LAYERS} files; export all in one file")
            if found is not None:
                pending.append(found)
    return Usd.Stage.Open(str(path.resolve()))


def prims(stage: Any) -> Iterator[Any]:
    """The prims of a stage, parents first. Raises RefusedError if there are very many."""
    for number, prim in enumerate(stage.Traverse()):
        if number == _MAX_PRIMS:
            raise RefusedError(f"must hold at most {_MAX_PRIMS:,} prims; export only what is needed of it")
        yield prim

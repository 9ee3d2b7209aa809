"""The stages that turn a scene into strokes: load, prune, cluster and recolor; `prepare` calls them in order.

Each adds a `Stage` to the report, and imports heavy packages only when it runs.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.core.memory import keep_freed
from brushgs.errors import SceneError
from brushgs.options.choices import STYLE_SUFFIX
from brushgs.options.painting import DEFAULT_KEEP, ClusterConfig, PaletteConfig, PruneConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.options.sequence import SequenceConfig
from brushgs.options.stroke_target import ErrorBudget, StrokeSize
from brushgs.pipeline.blocks.budget import Budget
from brushgs.pipeline.count import choose_count, cluster_to_target, describe_search
from brushgs.pipeline.make_strokes import StrokeMaker
from brushgs.pipeline.report import Report, Stage
from brushgs.pipeline.runner import KEPT
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.passes.color.recolor import Palette
    from brushgs.stroke_count.search import Clustered
    from brushgs.stroke_count.view_model import ViewModel
    from brushgs.values.arrays import F64, Mask
    from brushgs.values.notes import LoadNotes

SMALL_SCENE = 256  # Gaussians that are kept if the number of strokes is not chosen yet
TRAINED = {"antialiased": "antialiased", "2dgs": "2DGS, flat discs"}  # in words
MOST_NAMES = 6  # of unread columns
MANY_ROWS = 1_000_000  # below, reusing memory saves no time, and takes 30 % more of it
SMALLEST, LARGEST = 1e-24, 1e24  # world units: beyond, float32 leaves pictures blank


def load_scene(
    scene: SceneFiles, report: Report, *, makes_strokes: bool = False, workers: SequenceConfig | None = None
) -> "tuple[Gaussians, LoadNotes]":
    """Read the Gaussians of a scene, and notes on its files.

    Args:
        scene: see `SceneSource`.
        report: gets the stage.
        makes_strokes: whether they are only used to make strokes: then a scene larger than memory is read in
            blocks and merged, see `brushgs.pipeline.blocks`.
        workers: read such blocks; None for this machine.
    """
    with report.stage("load") as stage:
        from brushgs.formats.scenes.read import open_files, read_files

        source = SceneSource.of(scene)
        files = open_files(source, source.lod)
        budget = Budget.of(source.memory)
        if sum(file.num_rows for file in files) >= MANY_ROWS:
            keep_freed()
        if is_larger := makes_strokes and budget.is_below(files):
            from brushgs.pipeline.blocks.load import load_in_blocks

            gaussians, notes = load_in_blocks(files, source.lod, budget, workers, report=report)
        else:
            gaussians, notes = read_files(files)
        notes = replace(notes, camera_folders=source.camera_folders())
        dropped = f", {notes.rows_dropped:,} rows dropped" if notes.rows_dropped else ""
        degree = f"SH degree {notes.sh_degree_used}"
        what = "strokes" if notes.is_strokes else "Gaussians"
        training = "" if notes.training == "default" else f", {TRAINED[notes.training]}"
        num_used = notes.rows_read - notes.rows_dropped
        stage.did = f"{num_used:,} {what}, {degree}, {notes.format}{training}{dropped}"
        if is_larger:
            stage.did += f"; {budget.words(files)}: read in blocks and merged into {len(gaussians):,}"
        if notes.unknown:
            stage.did += f"; {not_read(notes.unknown)}"
        stage.counts = {
            "gaussians": len(gaussians),
            "rows_read": notes.rows_read,
            "rows_dropped": notes.rows_dropped,
            "sh_degree_stored": notes.sh_degree_stored,
            "sh_degree_used": notes.sh_degree_used,
            "format": notes.format,
            "is_strokes": notes.is_strokes,
            "training": notes.training,
            "columns_not_read": list(notes.unknown),
            "files": len(notes.files) or 1,
        }
        if is_larger:
            stage.counts["memory"] = budget.memory
        _check_unit(gaussians, source)
        stage.details += notes.files
        if notes.sh_degree_used < notes.sh_degree_stored:
            stage.details.append(zero_degrees(notes.sh_degree_used, notes.sh_degree_stored))
    return gaussians, notes


def _check_unit(gaussians: Gaussians, source: SceneSource) -> None:
    """Refuse a scene whose unit is out of the range of float32: by the largest number, or by half of all
    rows.
    """
    reach = np.maximum(np.abs(gaussians.means).max(axis=1), gaussians.scales.max(axis=1))
    size = float(reach.max(initial=0))
    if 0 < size < SMALLEST or (size > LARGEST and (size := float(np.median(reach))) > LARGEST):
        limits = f"{SMALLEST:g} to {LARGEST:g}"
        what = f"is {size:.2g} units large, and scenes of {limits} units can be painted"
        raise SceneError(source.files()[0], f"{what}; scale it before it is exported")


def not_read(columns: Sequence[str]) -> str:
    """Columns of a file that are not read, in words."""
    more = ", ..." if len(columns) > MOST_NAMES else ""
    names = ", ".join(columns[:MOST_NAMES])
    return f"{len(columns)} column{'s' * (len(columns) != 1)} not read: {names}{more}"


def zero_degrees(used: int, stored: int) -> str:
    """The SH degrees above the highest one that is used, as a detail of a stage."""
    degrees = f"degree {stored}" if used + 1 == stored else f"degrees {used + 1} to {stored}"
    return f"SH {degrees} skipped: zero in every row"


def prune_scene(
    gaussians: Gaussians,
    config: PruneConfig,
    report: Report,
    *,
    at_least: int = 1,
    why_all: str | None = None,
    among: "Mask | None" = None,
) -> Gaussians:
    """Keep the Gaussians of highest weight.

    Args:
        gaussians: the scene as loaded.
        config: which Gaussians are kept.
        report: gets the stage.
        at_least: how many are kept, see `least_kept`.
        why_all: why all are kept; None if some may be dropped.
        among: [N] those that may be dropped; None for all.
    """
    with report.stage("prune") as stage:
        num_before = len(gaussians)
        reason = "keep = 1" if config.keep == 1 else why_all
        if reason is None:
            from brushgs.passes.reduce.prune import prune

            num_fixed = 0 if among is None else num_before - int(among.sum())
            gaussians = prune(gaussians, config.keep, weight=config.weight, at_least=at_least, among=among)
            stage.did = f"kept {len(gaussians):,} of {num_before:,} by {config.weight}"
            if among is not None:
                stage.did += f", {len(gaussians) - num_fixed:,} of {num_before - num_fixed:,} in this part"
            usual = DEFAULT_KEEP * (num_before - num_fixed) + num_fixed + 1
            if config.keep is None and len(gaussians) > max(at_least, usual):
                stage.details.append("not fewer: what else could go contributes too much")
        else:
            stage.did = f"kept all {num_before:,}"
            stage.skipped.append(f"pruning: {reason}")
        stage.counts = {"before": num_before, "after": len(gaussians), "weight": config.weight}
    return gaussians


def least_kept(
    num: int,
    config: PruneConfig,
    cluster: ClusterConfig,
    *,
    is_strokes: bool,
    is_seen: bool,
    is_merged: bool,
) -> tuple[int, str | None]:
    """How many Gaussians pruning keeps at least, 1 where it keeps more by itself, and why all; or None.

    Unless the config states a share, all strokes are kept, and of a scene at least as many Gaussians as the
    requested number of strokes: pruning is for those that would be merged anyway.

    Args:
        num: the number of Gaussians.
        config: which Gaussians are kept.
        cluster: how many strokes will be made.
        is_strokes: whether they are strokes already.
        is_seen: whether hidden and faint Gaussians are already dropped.
        is_merged: whether they were merged while reading: a painting of the truck in 500 or 2000 strokes is
            0.1 to 0.3 dB better without pruning.
    """
    if config.keep is not None:
        return 1, None
    if is_strokes:
        return num, "they are strokes already"
    if is_seen:
        return num, "what is not seen is dropped already"
    if is_merged:
        return num, "they were merged while they were read"
    if cluster.target is None and cluster.strokes is None:
        return num, "every Gaussian is a stroke"
    count = min(num, SMALL_SCENE) if cluster.target is not None else cluster.num_strokes(num)
    if num <= count and cluster.target is None:
        return count, f"{num:,} Gaussians are not more than {count:,} strokes"
    return (count if count > DEFAULT_KEEP * num else 1), None


def cluster_scene(
    maker: StrokeMaker, report: Report, *, num_loaded: int, view_model: "ViewModel | None" = None
) -> "Clustered":
    """Merge Gaussians into fewer and larger ones, the strokes in space, and apply the passes of the options.

    Returns the strokes, and the grouping of the Gaussians; None if each is a stroke.

    Args:
        maker: makes strokes of the pruned scene.
        report: gets the stage, that of the choice of a count for a target, and those of the passes.
        num_loaded: number of Gaussians in the scene as loaded; a share refers to it.
        view_model: from `open_view_model`: the view of a target.
    """
    gaussians, config = maker.gaussians, maker.cluster
    choice, are_changed = None, maker.skip is None
    if view_model is not None:
        choice = choose_count(gaussians, config, view_model, report, are_changed=are_changed)
    with report.stage("cluster", apart=maker.pass_watch) as stage:
        num, target, found = len(gaussians), config.target, None
        if choice is None or view_model is None:
            count = config.num_strokes(num_loaded) if config.strokes is not None else num
            clustered = maker(count)
        elif isinstance(target, ErrorBudget | StrokeSize):
            found = cluster_to_target(num, target, view_model, choice, maker, are_changed=are_changed)
            count, clustered = found.count, found.clustered
        else:
            count = choice.strokes
            clustered = maker(count)
        _describe_clusters(clustered, num, count, config, stage)
        if "cluster" in maker.memory.found:
            stage.details.append(KEPT)
        if found is not None and isinstance(target, ErrorBudget | StrokeSize):
            describe_search(found, target, stage)
        if maker.skip is not None:
            stage.skipped.append(f"{', '.join(one.name for one in maker.passes)}: {maker.skip}")
    if maker.skip is None:
        for one in maker.passes:
            one.report(report)
    return clustered


def _describe_clusters(
    clustered: "Clustered", num_before: int, count: int, config: ClusterConfig, stage: Stage
) -> None:
    strokes, grouping = clustered
    stage.counts = {"before": num_before, "asked": count, "after": len(strokes), "method": None}
    if grouping is None:
        stage.did = f"{num_before:,} strokes, one per Gaussian"
        why = (
            "every Gaussian is a stroke"
            if config.strokes is None
            else f"{num_before:,} Gaussians are not more than {count:,} strokes"
        )
        stage.skipped.append(f"clustering: {why}")
        return
    stage.did = f"{num_before:,} into {len(strokes):,} strokes"
    dropped = grouping.num_clusters - len(strokes)
    if dropped:
        stage.did += f", {dropped:,} not worth keeping dropped"
    stage.details.append(f"by {grouping.method}, {grouping.num_steps} steps ({grouping.reason})")
    if grouping.num_split:
        stage.details.append(f"{grouping.num_split:,} by splitting where pictures of strokes were wrong")
    stage.counts |= {
        "method": grouping.method,
        "steps": grouping.num_steps,
        "inertia": grouping.inertia,
        "split": grouping.num_split,
        "dropped": dropped,
    }


def open_palette(config: PaletteConfig | None, report: Report) -> "Palette | None":
    """Open the palette; a stage only if there is one."""
    if config is None:
        return None
    with report.stage("palette") as stage:
        from brushgs.formats.pictures.images import read_image
        from brushgs.passes.color.recolor import Palette

        if config.file.suffix.lower() == STYLE_SUFFIX:
            return _palette_of_style(config, stage)
        image = read_image(config.file)
        try:
            palette = Palette.of_image(image, space=config.space)
        except ValueError as error:
            raise SceneError(
                config.file, f"has no colors to take ({error}); choose another picture"
            ) from None
        height, width = image.shape[:2]
        stage.did = f"{config.file}, {width}x{height} pixels"
        stage.counts = {"path": str(config.file), "width": width, "height": height}
    return palette


def _palette_of_style(config: PaletteConfig, stage: Stage) -> "Palette":
    from brushgs.formats.styles import read_style
    from brushgs.passes.color.recolor import Palette

    style = read_style(config.file)
    if style.palette is None:
        raise SceneError(config.file, "is the style of an edit, which has no colors; give that of a painting")
    stage.did = f"{config.file}, {len(style.palette.colors)} colors"
    stage.counts = {"path": str(config.file)}
    return Palette.of_colors(style.palette.samples, style.palette.weights, space=config.space)


def cut_scene(gaussians: Gaussians, cameras: Sequence[Camera], report: Report) -> Gaussians:
    """Gaussians cut so that none covers much of a picture.

    They are cut before strokes are made, so that the pieces count as strokes.
    """
    with report.stage("slabs") as stage:
        from brushgs.passes.form.slabs import LONGEST, cut_slabs

        pieces, _ = cut_slabs(gaussians, cameras)
        stage.did = f"{len(gaussians):,} to {len(pieces):,} Gaussians, none longer than {LONGEST:.0%} of"
        stage.did += " a picture"
        stage.counts = {"before": len(gaussians), "after": len(pieces)}
        if pieces is gaussians:
            stage.did = "nothing"
            stage.skipped.append("slabs: no Gaussian covers much of a picture")
    return pieces


def recolor_scene(
    gaussians: Gaussians,
    palette: "Palette | None",
    config: PaletteConfig | None,
    report: Report,
    *,
    is_strokes: bool = True,
    shares: "F64 | None" = None,
) -> Gaussians:
    """Give strokes, or Gaussians, the colors of the palette; a stage only if there is one.

    `shares` [N] 0 to 1 is the strength for each, None for 1: at 0 colors are unchanged, bit for bit.
    """
    if palette is None or config is None:
        return gaussians
    with report.stage("recolor") as stage:
        from brushgs.passes.color.recolor import recolor

        gaussians = recolor(gaussians, palette, config.strength, shares=shares)
        what = "strokes" if is_strokes else "Gaussians"
        num = len(gaussians) if shares is None else int((shares > 0).sum())
        stage.did = f"{num:,} {what}, {config.strength:.0%} of the way in {config.space}"
        stage.counts = {what.lower(): num, "strength": config.strength, "space": config.space}
        if config.strength == 0:
            stage.skipped.append("recoloring: the strength is 0")
    return gaussians


def name_of(source: SceneFiles | None, notes: "LoadNotes | None" = None) -> str:
    """The name of a scene: for strokes that of their scene, else that of the files."""
    stored = None if notes is None else notes.scene
    return stored or ("scene" if source is None else SceneSource.of(source).name)


def write_scene(
    gaussians: Gaussians,
    output: str | Path,
    report: Report,
    *,
    is_strokes: bool = False,
    scene: str | None = None,
    first_view: FirstView | None = None,
    brushes: Sequence[str] = (),
) -> Report:
    """Write Gaussians to a scene file, and complete the report.

    As far as its format allows, the file records whether they are strokes, the name and first view of their
    scene, so that `render` shows both from the same cameras, and the brushes of strokes. If the format rounds
    numbers, the stage reports by how much.
    """
    with report.stage("write") as stage:
        from brushgs.formats.scenes import write

        losses = write.write_scene(
            gaussians,
            output,
            is_strokes=is_strokes,
            scene=scene,
            first_view=first_view,
            brushes=brushes,
            measures=True,
        )
        size = Path(output).stat().st_size
        stage.did = f"{output}, {file_size(size)}"
        stage.counts = {"path": str(output), "bytes": size, "gaussians": len(gaussians)}
        if losses is not None:
            stage.counts |= losses.counts()
            stage.details += losses.words()
    report.output = str(output)
    return report


def file_size(num_bytes: int) -> str:
    """The size of a file in words, such as "12.3 MB"."""
    return f"{num_bytes / 1e6:,.1f} MB" if num_bytes >= 1e6 else f"{num_bytes / 1e3:,.0f} kB"

"""`brushgs refine`: a scene becomes strokes, the strokes are refined, and written as a scene of their own.

stroke (-> palette) -> load -> prune -> cluster (-> recolor) -> views -> refine -> write
"""

import importlib.util
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.config import PaintConfig, PaletteConfig, RefineConfig, Up
from brushgs.counting import look
from brushgs.framing import DEFAULT_UP
from brushgs.io.images import read_image
from brushgs.pipeline import check_output, input_files
from brushgs.report import Report
from brushgs.scene import Gaussians
from brushgs.shapes import Array
from brushgs.stages import (
    box_sigmas,
    choose_camera,
    cluster_scene,
    load_scene,
    open_palette,
    open_stroke,
    prune_scene,
    recolor_scene,
    view_lock,
    write_scene,
)

if TYPE_CHECKING:
    from brushgs.refine.distil import Lesson
    from brushgs.refine.fit import Drawing, Plan
    from brushgs.refine.nnfm import Style

JUDGES = 6  # views held out


def refine_file(
    scene: str | Path,
    output: str | Path,
    paint: PaintConfig | None = None,
    config: RefineConfig | None = None,
    *,
    report: Report | None = None,
) -> Report:
    """Refine the strokes of a scene file; write them as a scene file.

    Args:
        scene: a trained 3D Gaussian scene.
        output: scene file (.ply) to write.
        paint: how strokes are made and will be drawn; of its view only what is up.
        config: see `RefineConfig`.
        report: where the stages are told; a new one if None.

    Returns:
        The report, with one stage per step.

    Raises:
        SceneError: if a file cannot be read or written, or PyTorch is missing.
        ValueError: if an option does not suit the scene.
    """
    paint, config, report = paint or PaintConfig(), config or RefineConfig(), report or Report()
    output = Path(output)
    extras = tuple(path for path in (config.style, config.vgg_weights) if path is not None)
    check_output(output, (".ply",), inputs=(*input_files(scene, paint), *extras))
    check_torch()
    if config.style is not None and paint.palette is None:
        paint = replace(paint, palette=PaletteConfig(config.style))
    texture = open_stroke(paint.draw, report)
    palette = open_palette(paint.palette, report)
    gaussians, file_up = load_scene(scene, report)
    sight = None
    if paint.cluster.aim is not None:  # only a count for a picture needs one
        camera = choose_camera(gaussians, paint.view, report, file_up=file_up)
        sight = look(gaussians, camera, texture, paint.cluster, paint.draw, None, report)
    strokes = prune_scene(gaussians, paint.prune, report)
    strokes = cluster_scene(strokes, paint.cluster, report, num_loaded=len(gaussians), sight=sight)
    strokes = recolor_scene(strokes, palette, paint.palette, report)

    from brushgs.refine.fit import Drawing, Plan

    drawing = Drawing(texture, box_sigmas(texture, paint.draw), paint.draw.filter, view_lock(paint.draw))
    if palette is not None and paint.palette is not None:
        from brushgs.passes.recolor import recolor

        gaussians = recolor(gaussians, palette, paint.palette.strength)
    lessons, judges = _lessons(gaussians, paint.view.up or file_up or DEFAULT_UP, config, report)
    plan = Plan(
        config.steps, seed=config.seed, checkpoint=checkpoint_of(output), is_resumed=config.is_resumed
    )
    strokes = refine_strokes(strokes, lessons, judges, drawing, plan, config, report)
    return write_scene(strokes, output, report)


def refine_strokes(
    strokes: Gaussians,
    lessons: "Sequence[Lesson]",
    judges: "Sequence[Lesson]",
    drawing: "Drawing",
    plan: "Plan",
    config: RefineConfig,
    report: Report,
) -> Gaussians:
    """The stage itself: strokes toward the plain picture, or toward a style image."""
    from brushgs.refine.distil import distil, mean_psnr
    from brushgs.refine.members import members
    from brushgs.refine.variables import Variables

    with report.stage("refine", frames=plan.steps, of="steps") as stage:
        moves = members(config.where, strokes)
        variables = Variables(strokes, config.params, moves)
        before = mean_psnr(strokes, judges, drawing)

        def advance(score: float) -> None:
            report.advance(f"{score:.2f} dB")

        if config.style is None:
            refined, curve = distil(variables, lessons, judges, drawing, plan, advance)
        else:
            from brushgs.refine.style import RATES, stylise

            painting = read_image(config.style)
            style = _style(painting, config, plan.seed)
            refined, curve = stylise(
                variables,
                lessons,
                judges,
                style,
                painting,
                drawing,
                replace(plan, rates=RATES),
                advance=advance,
            )
        after = mean_psnr(refined, judges, drawing)
        stage.did = (
            f"{int(moves.sum()):,} strokes, {config.params}: {before:.2f} to {after:.2f} dB to the plain "
            f"picture in {len(judges)} other views; {curve.stopped}"
        )
        if config.style is not None:
            fallen = 1 - 10 ** (-(max(curve.scores) - curve.scores[0]) / 10)
            stage.did += f"; the loss to {config.style.name} fell by {fallen:.0%}"
        stage.counts = {
            "params": config.params,
            "moved": int(moves.sum()),
            "psnr_before": round(before, 4),
            "psnr_after": round(after, 4),
            "stopped": curve.stopped,
            **{f"curve_{name}": values for name, values in asdict(curve).items() if name != "stopped"},
        }
        if not moves.all():
            stage.left_out.append(f"{int((~moves).sum()):,} strokes outside {config.where}: not touched")
    return refined


def check_torch() -> None:
    """Refuse to refine without PyTorch, before any work.

    Raises:
        ValueError: if it is not installed.
    """
    if importlib.util.find_spec("torch") is None:
        raise ValueError("refine needs PyTorch, which is not installed; pip install 'brushgs[refine]'")


def checkpoint_of(output: Path) -> Path:
    """Where a run that writes `output` keeps what it needs to be gone on with."""
    return output.with_name(f"{output.stem}.checkpoint")


def _lessons(
    gaussians: Gaussians, up: Up, config: RefineConfig, report: Report
) -> "tuple[list[Lesson], list[Lesson]]":
    """Views to learn from and to judge by, with the plain picture in each."""
    with report.stage("views") as stage:
        from brushgs.refine.distil import Lesson
        from brushgs.refine.views import views_around

        width, height = config.size
        lessons, judges = (
            [
                Lesson.of(gaussians, view)
                for view in views_around(gaussians, num, width=width, height=height, up=up, shift=shift)
            ]
            for num, shift in ((config.views, 0.0), (JUDGES, 0.5))
        )
        stage.did = f"{config.views} to learn from, {JUDGES} others to judge by, {width}x{height}"
        stage.counts = {"views": config.views, "judges": JUDGES, "width": width, "height": height}
    return lessons, judges


def _style(painting: Array, config: RefineConfig, seed: int) -> "Style":
    """The features of a painting: VGG's where there are weights, else the weight-free ones."""
    import torch

    from brushgs.refine.bank import FilterBank
    from brushgs.refine.nnfm import Style
    from brushgs.refine.vgg import Vgg, find_weights

    rgb = painting[..., :3] if painting.shape[2] >= 3 else np.repeat(painting[..., :1], 3, axis=2)
    there = None
    if painting.shape[2] in (2, 4):  # what is not painted is no style: its colour there is anything
        alpha = painting[..., -1:]
        mean = (rgb * alpha).sum(axis=(0, 1)) / max(float(alpha.sum()), 1e-9)
        rgb = rgb * alpha + (1 - alpha) * mean.astype(rgb.dtype)
        there = torch.from_numpy(np.ascontiguousarray(alpha[..., 0]))
    pixels = torch.from_numpy(np.ascontiguousarray(rgb)).permute(2, 0, 1).contiguous()
    weights = config.vgg_weights or find_weights()
    features = FilterBank(pixels) if weights is None else Vgg(weights)
    return Style(features, pixels, there, seed=seed)

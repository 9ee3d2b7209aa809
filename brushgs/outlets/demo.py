"""Build the example scene, write it like a trained scene, and paint it."""

from pathlib import Path

from brushgs.brushes.brush_set import name_of
from brushgs.formats import save
from brushgs.formats.moving.write import NAME
from brushgs.formats.registry import SCENE_SUFFIXES, VIDEO_SUFFIXES
from brushgs.options.choices import MOMENTS_PER_SECOND
from brushgs.options.painting import PaintConfig
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.outputs import check_encoding, check_output, free_name
from brushgs.pipeline.report import Report
from brushgs.pipeline.sequence import paint_sequence
from brushgs.pipeline.still import paint_file
from brushgs.pipeline.strokes import file_size, write_scene
from brushgs.still_life import still_life, still_life_camera
from brushgs.still_life.moving import SECONDS, still_life_moving
from brushgs.values.sh import seen_from
from brushgs.values.shot import Origin

SCENE_NAME = "still_life.ply"
CLIP_NAME = "still_life_moving"
# 1.5 MB per moment; with the Gaussians and highlights of the still scene it would be 13 MB.
MOVING_GAUSSIANS = 20_000
SIZE, FILM_SIZE = (1200, 900), (960, 720)  # pixels


def paint_demo(
    folder: str | Path,
    config: PaintConfig,
    *,
    report: Report,
    num_gaussians: int | None = None,
    name: str | None = None,
    origin: Origin | None = None,
) -> Report:
    """Write the still life as `still_life.ply` into a folder and paint it beside that.

    Args:
        folder: made if missing; files of the same names are replaced.
        config: of the painting; the clustering seed is also that of the scene. Of the view only `size` is
            used, None for 1200 x 900.
        report: collects the stages.
        num_gaussians: of the scene; None for the default of `still_life`.
        name: in the file name, still_life-NAME.png; None for that of the stroke.
        origin: metadata of the painting; or None.

    Raises:
        SceneError: if the folder cannot be made or written to.
    """
    folder = Path(folder)
    scene, picture = folder / SCENE_NAME, folder / f"still_life-{name or name_of(config.draw.stroke)}.png"
    picture = picture if origin is None else free_name(picture, origin)
    check_output(scene, SCENE_SUFFIXES)
    with report.stage("build") as stage:
        counts = {} if num_gaussians is None else {"num_gaussians": num_gaussians}
        gaussians = still_life(seed=config.cluster.seed, **counts)
        stage.did = f"a still life of {len(gaussians):,} Gaussians, SH degree 3"
        stage.counts = {"gaussians": len(gaussians)}
    write_scene(gaussians, scene, report)
    del gaussians
    width, height = config.view.fixed_size or SIZE
    camera = still_life_camera(width=width, height=height)
    return paint_file(scene, picture, config, camera=camera, report=report, origin=origin)


def paint_moving_demo(
    folder: str | Path,
    config: PaintConfig,
    *,
    report: Report,
    num_gaussians: int = MOVING_GAUSSIANS,
    name: str | None = None,
    origin: Origin | None = None,
) -> Report:
    """Write the moving still life as one scene file per moment, 24 per second, and paint a film of it.

    Args:
        folder: made if missing; gets the folder `still_life_moving`, whose moments are replaced, and the
            film.
        config: as for `paint_demo`; the default size is 960 x 720 pixels.
        report: gets the stages.
        num_gaussians: approximate count, >= 1000.
        name: in the file name, still_life_moving-NAME.mp4; None for that of the stroke.
        origin: metadata of the painting; or None.

    Raises:
        SceneError: if the folder cannot be made or written to.
    """
    folder = Path(folder)
    clip, film = folder / CLIP_NAME, folder / f"{CLIP_NAME}-{name or name_of(config.draw.stroke)}.mp4"
    files = [clip / (NAME % moment) for moment in range(round(SECONDS * MOMENTS_PER_SECOND))]
    check_output(files[0], SCENE_SUFFIXES)
    film = film if origin is None else free_name(film, origin)
    check_output(film, VIDEO_SUFFIXES)
    check_encoding(film, config)
    scene = still_life_moving(num_gaussians, config.cluster.seed)
    width, height = config.view.fixed_size or FILM_SIZE
    camera = still_life_camera(width=width, height=height)
    with report.stage("build", total=len(files), unit="moments") as stage:
        for moment, path in enumerate(files):
            gaussians = seen_from(scene.at(moment / MOMENTS_PER_SECOND), camera.position)
            save(gaussians, path)
            report.advance()
        size = sum(path.stat().st_size for path in files)
        stage.did = f"{clip}, {len(files)} moments of {len(gaussians):,} Gaussians, {file_size(size)}"
        stage.counts = {"gaussians": len(gaussians), "moments": len(files), "bytes": size, "path": str(clip)}
    return paint_sequence(Clip(scene), film, camera, config, report=report, origin=origin)

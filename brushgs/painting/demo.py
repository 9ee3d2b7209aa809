"""The example scene, built, written as a trained scene would be, and painted."""

from pathlib import Path

from brushgs.brushes.brush_set import name_of
from brushgs.errors import SceneError
from brushgs.io.scenes.formats import SCENE_SUFFIXES
from brushgs.options.painting import PaintConfig
from brushgs.painting.outputs import check_output
from brushgs.painting.report import Report
from brushgs.painting.still import paint_file
from brushgs.painting.strokes import write_scene
from brushgs.still_life import still_life, still_life_camera

SCENE_NAME = "still_life.ply"
SIZE = (1200, 900)  # pixels


def paint_demo(
    folder: str | Path,
    config: PaintConfig,
    *,
    report: Report,
    num_gaussians: int | None = None,
    name: str | None = None,
) -> Report:
    """Write the still life as `still_life.ply` into a folder and paint it beside that.

    Args:
        folder: made if missing; files of the same names are replaced.
        config: of the painting; the seed of its clustering is also that of the scene, and of its view only
            the size is used, 1200 x 900 pixels if None.
        report: gets the stages.
        num_gaussians: of the scene; None for the default of `still_life`.
        name: of the painting, still_life-NAME.png; None for that of the stroke.

    Raises:
        SceneError: if the folder cannot be made or written to.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SceneError(folder, f"the folder cannot be made: {error.strerror}") from None
    scene, picture = folder / SCENE_NAME, folder / f"still_life-{name or name_of(config.draw.stroke)}.png"
    check_output(scene, SCENE_SUFFIXES)
    with report.stage("build") as stage:
        counts = {} if num_gaussians is None else {"num_gaussians": num_gaussians}
        gaussians = still_life(seed=config.cluster.seed, **counts)
        stage.did = f"a still life of {len(gaussians):,} Gaussians, SH degree 3"
        stage.counts = {"gaussians": len(gaussians)}
    write_scene(gaussians, scene, report)
    del gaussians
    width, height = config.view.size or SIZE
    camera = still_life_camera(width=width, height=height)
    return paint_file(scene, picture, config, camera=camera, report=report)

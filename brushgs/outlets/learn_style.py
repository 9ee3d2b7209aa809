"""Learn a style from a painting: `brushgs style learn` and `brushgs.learn_style`."""

from pathlib import Path

from brushgs.errors import SceneError
from brushgs.formats.files import check_plain
from brushgs.formats.pictures.images import read_image
from brushgs.formats.styles import write_style
from brushgs.options.choices import STYLE_SUFFIX
from brushgs.passes.style.dictionary import FEW, MANY
from brushgs.passes.style.margins import inside_margins
from brushgs.passes.style.marks import learn_marks
from brushgs.passes.style.palette import learn_palette
from brushgs.pipeline.outputs import check_output
from brushgs.pipeline.report import Report
from brushgs.values.style import Style


def learn_style(painting: str | Path, *, name: str | None = None, small: bool = False) -> Style:
    """Learn the style of a painting: its palette and its marks.

    Args:
        painting: a picture in one of the formats that are read; what is transparent in it does not count, nor
            do even margins all around, such as a mount.
        name: of the style; None for that of the file.
        small: whether few of its marks are kept: 64 in place of 192.

    Raises:
        SceneError: if the file cannot be read as a picture, or there is nothing to learn from it.

    Example:
        >>> small = camera.resized(160, 120)
        >>> bg.save(bg.render(strokes, small, "flat", underpaint=True), "painting.png")
        >>> bg.learn_style("painting.png")
        Style('painting', ... colors...)
    """
    return learn_painting(Path(painting), name, Report(), small=small)


def learn_painting(painting: Path, name: str | None, report: Report, *, small: bool) -> Style:
    """`learn_style` in stages."""
    with report.stage("load") as stage:
        image = read_image(painting)
        height, width = image.shape[:2]
        stage.did = f"{painting}, {width}x{height} pixels"
        image = image[inside_margins(image)]
        if image.shape[:2] != (height, width):
            stage.did += f", without margins {image.shape[1]}x{image.shape[0]}"
        stage.counts = {"path": str(painting), "width": width, "height": height}
    with report.stage("palette") as stage:
        try:
            palette = learn_palette(image)
        except ValueError as error:
            raise SceneError(painting, f"has no colors to learn ({error}); choose another picture") from None
        stage.did = f"{len(palette.colors)} colors: {', '.join(color.name for color in palette.colors)}"
        stage.counts = {"colors": len(palette.colors), "samples": len(palette.samples)}
    with report.stage("marks") as stage:
        marks = None
        try:
            marks = learn_marks(image, FEW if small else MANY)
        except ValueError as error:
            stage.skipped.append(f"marks: {str(error).removeprefix('learn_marks: ')}")
        if marks is not None:
            stage.did = f"{marks.length:.1%} of the shorter side long, {marks.aspect:.1f} times their width"
            num = 0 if marks.dictionary is None else len(marks.dictionary)
            stage.did += f"; {num} of them are kept" if num else ""
            stage.counts = {
                "length": marks.length,
                "aspect": marks.aspect,
                "brushes": len(marks.brushes),
                "dictionary": num,
            }
    if marks is None:
        return Style(printable(name or painting.stem), palette)
    with report.stage("surroundings") as stage:
        from brushgs.passes.style.contours import learn_lines
        from brushgs.passes.style.quilt import learn_stage

        lines = learn_lines(image, marks)
        flatness = Style(painting.stem, palette, marks, lines=lines).flatness
        around = learn_stage(image, flatness)
        height, width = around.colors.shape[:2]
        stage.did = f"a map of {width}x{height}"
        stage.did += "" if lines is None else f", and contours of {lines.width:.1%} of the shorter side"
        stage.counts = {"width": width, "height": height, "lines": 0.0 if lines is None else lines.share}
    return Style(printable(name or painting.stem), palette, marks, stage=around, lines=lines)


def learn_file(
    painting: Path, output: Path, name: str | None, report: Report, *, small: bool = False
) -> Report:
    """Learn the style of a painting and write it.

    Raises:
        ValueError: if the output has another suffix than .style.
        SceneError: see `learn_style`; or if the output cannot be written, or is the painting.
    """
    check_plain(painting, "picture")
    check_output(output, (STYLE_SUFFIX,), inputs=(painting,))
    return write_learnt(learn_painting(painting, name, report, small=small), output, report)


def write_learnt(style: Style, output: Path, report: Report) -> Report:
    """Write a style as the last stage."""
    with report.stage("write") as stage:
        write_style(style, output)
        size = output.stat().st_size
        stage.did = f"{output}, {size / 1000:.0f} kB"
        stage.counts = {"bytes": size}
    report.output = str(output)
    return report


def printable(name: str) -> str:
    """A valid style name from any file name."""
    return "".join(c if c.isprintable() else "?" for c in name)[:80].strip() or "style"

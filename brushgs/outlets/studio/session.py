"""Settings -> painting for the page; a view of it -> picture or video.

No threads and no HTTP. Steps unaffected by a change are not repeated, see `brushgs.pipeline.memory`; pictures
and videos show the same strokes as the page.
"""

import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from brushgs.brushes.builtin import stroke_notes
from brushgs.errors import SceneError
from brushgs.formats.marks import MARKS_SUFFIX
from brushgs.options.choices import LOOKS
from brushgs.options.overpaint import OverpaintConfig
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneSource
from brushgs.options.table import number_text
from brushgs.outlets.page.container import write_container
from brushgs.outlets.page.contents import page_contents
from brushgs.outlets.page.export import command_of, of_stills, view_of
from brushgs.outlets.page.motion import PageMotion
from brushgs.outlets.studio.overpainting import HandStroke, Overpainting
from brushgs.outlets.studio.saved import SavedOptions
from brushgs.outlets.studio.settings import Film, Known, Settings, Shot, flags_of, overrides_of, shown_lamp
from brushgs.outlets.studio.where import Finder, Members, given_in, read_where
from brushgs.pipeline.overpaint import balls_of, open_overpaint, overpainted
from brushgs.pipeline.prepare import PICTURE, Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Memory
from brushgs.values.arrays import Rows
from brushgs.values.shot import Origin, without_folders
from brushgs.values.shot import Shot as PictureShot

if TYPE_CHECKING:
    from collections.abc import Iterator

    from brushgs.pipeline.clip import Clip

QUICK = 1  # gzip level for local use: 0.1 s for 6700 strokes; level 9 takes 0.5 s
MAX_NUMBER = 99_999  # of the files of one name


@dataclass(frozen=True)
class Dropped:
    """A picture that was dropped on the page.

    Attributes:
        name: original name, for people and the command line.
        path: stored file.
    """

    name: str
    path: Path


@dataclass(frozen=True, eq=False)
class Painted:
    """A painting that the page shows.

    Attributes:
        settings: its settings.
        config: their options.
        prepared: its strokes.
        contents: of the page, as `write_container` packs them.
        facts: values for the panel, for JSON.
        rows: for each coat, rows of its strokes in page order.
        command: words after `brushgs render` that paint the same.
    """

    settings: Settings
    config: PaintConfig
    prepared: Prepared
    contents: bytes
    facts: Mapping[str, Any]
    rows: tuple[Rows, ...] = ()
    command: tuple[str, ...] = ()


@dataclass
class Session:
    """A scene in the studio.

    Attributes:
        source: its files.
        config_of: makes options from the command line with overrides, see `overrides_of`.
        look: the look of the command line.
        options: words of `brushgs render` from the command line, without overridden ones.
        folder: for pictures and videos.
        dropped: dropped pictures by id.
        writes_metadata: whether pictures and videos get metadata.
        saved: file of options to write at each change; or None.
        moment: that a page of a moving scene shows first, seconds from the start.
        clip_of: opens a moving scene; None for a still one, or one moment.
        marks: files of marks of the command line; the page goes on with the last one.
        new_memory: makes the memory of a scene's steps.
    """

    source: SceneSource
    config_of: Callable[[Mapping[str, Any]], PaintConfig]
    look: str
    options: Callable[[Mapping[str, Any]], list[str]]
    folder: Path = Path()
    dropped: dict[str, Dropped] = field(default_factory=dict)
    writes_metadata: bool = True
    saved: SavedOptions | None = None
    moment: float = 0.0
    clip_of: "Callable[[SceneSource], Clip | None]" = lambda source: None
    marks: Sequence[Path] = ()
    new_memory: Callable[[], Memory] = Memory
    _finder: Finder = field(default_factory=Finder)
    _below: tuple[PaintConfig, Prepared] | None = None  # the last painting without marks, and its options

    @cached_property
    def _memory(self) -> Memory:
        return self.new_memory()

    @property
    def known(self) -> Known:
        """The names currently allowed in settings."""
        looks = LOOKS if self.look in LOOKS else (self.look, *LOOKS)
        files = {key: one.path for key, one in self.dropped.items()}
        return Known(looks, tuple(note.name for note in stroke_notes()), files)

    @property
    def made(self) -> Mapping[str, int]:
        """Number of runs of each step."""
        return self._memory.made

    @cached_property
    def overpainting(self) -> Overpainting:
        """What is painted over the scene by hand. Raises SceneError if a file of marks cannot be read."""
        return Overpainting.of_files(self.marks, lambda: reserve(self.folder, self.source.name, MARKS_SUFFIX))

    @cached_property
    def clip(self) -> "Clip | None":
        """The moving scene; None for a still one, or one moment. Raises SceneError if it cannot be read."""
        return self.clip_of(self.source)

    def config(self, settings: Settings) -> PaintConfig:
        """The options of settings.

        Raises:
            ValueError: if one is out of range, they exclude each other, or a part would read files that are
                not on the command line.
        """
        if settings.part is not None:
            read_where(settings.part, given_in(self.config_of({})))
        return self.config_of(self._overrides(settings))

    def of_scene(self, source: SceneSource) -> "Session":
        """The same with another scene."""
        return replace(self, source=source, marks=(), moment=0.0, _finder=Finder(), _below=None)

    def save(self, settings: Settings) -> None:
        """Write the file of options, and the dropped pictures that they use.

        Raises:
            SceneError: if one cannot be written.
        """
        if self.saved is None:
            return
        given = (settings.stroke, settings.palette)
        used = {key: one for key, one in self.dropped.items() if key in given}
        names = {key: self.saved.keep(key, one.name, one.path) for key, one in used.items()}
        flags = [*flags_of(settings, names), *self._mark_flags]
        if self.moment > 0 and self.clip is not None:
            flags += ["--moment", number_text(self.moment)]
        self.saved.write(self._overrides(settings), flags)

    def paint(self, settings: Settings, report: Report) -> Painted:
        """Make the painting of settings.

        Raises:
            SceneError: if a file cannot be read.
            ValueError: if an option does not suit the scene.
        """
        config = self.config(settings)
        prepared = self._prepare(config, report)
        self._memory.close()
        first, options = command_of(self.source, self._options(settings), prepared.notes)
        with report.stage("page") as stage:
            contents = page_contents(
                prepared.painting,
                prepared.camera,
                view=view_of(prepared, config),
                title=self.source.name,
                command=(first, options),
                background=prepared.background,
                regions=prepared.region_names,
                motion=None if prepared.moving is None else PageMotion.of(prepared.moving),
            )
            packed = write_container(contents, level=QUICK)
            stage.did = f"{contents.num_strokes:,} strokes, {len(packed) / 1e6:.1f} MB"
            stage.counts = {"strokes": contents.num_strokes, "bytes": len(packed)}
        facts = self._facts(settings, config, prepared, contents.omitted)
        return Painted(settings, config, prepared, packed, facts, contents.rows, (first, *options))

    def _prepare(self, config: PaintConfig, report: Report) -> Prepared:
        """The strokes of a painting, and what is painted over them: a stroke lays that alone anew."""
        asks = (*PICTURE, "first_view", "scene")
        if self.clip is not None:
            return prepare(self.clip, of_stills(config), report, asks=asks, memory=self._memory)
        if config.overpaint.continues:  # marks change the strokes below
            return prepare(self.source, config, report, asks=asks, memory=self._memory)
        given = open_overpaint(config.overpaint)
        own = replace(config, overpaint=OverpaintConfig(balls=balls_of(given.joined)))
        if self._below is None or self._below[0] != own:
            self._below = None
            self._below = own, prepare(self.source, own, report, asks=asks, memory=self._memory)
        below = self._below[1]
        if not config.overpaint.files:
            return below
        coats = overpainted(below.painting.coats, below.strokes, given, config.draw.threads, report)
        return replace(below, painting=replace(below.painting, coats=tuple(coats)))

    def find(self, painted: Painted, text: object) -> Members:
        """The strokes in a part of the scene given as text, see `brushgs.outlets.studio.where`.

        Raises:
            ValueError: if it is invalid, does not exist, or would read files.
        """
        return self._finder.find(painted.prepared, painted.rows, read_where(text, given_in(painted.config)))

    def paint_over(self, painted: Painted, stroke: HandStroke) -> bool:
        """Do what a stroke of the page's brush means, in the file of marks; False if it meets nothing.

        Raises:
            ValueError: if there would be too many marks, or the scene moves.
            SceneError: if the file cannot be written, or another program changed it.
        """
        return self.overpainting.add(stroke, painted)

    def shoot(self, painted: Painted, shot: Shot, report: Report) -> Path:
        """Paint a view with the exact renderer, and return the file."""
        from brushgs.pipeline.drawing import write_picture
        from brushgs.pipeline.other_views import at_moment, seen_by
        from brushgs.pipeline.still import paint_view

        with self._new_file(painted, ".png") as path:
            seen = seen_by(at_moment(painted.prepared, shot.seconds), painted.config, shot.camera, report)
            frame = paint_view(seen, report, depth=False)
            known = PictureShot(shot.camera, origin=self._origin(painted))
            write_picture(frame, path, seen.background, painted.config, report, known)
        return path

    def film(self, painted: Painted, film: Film, report: Report) -> Path:
        """Paint a video with the exact renderer, and return the file."""
        from brushgs.cameras.orbit import sway
        from brushgs.cameras.paths import CameraPath, path_through, turn_around
        from brushgs.pipeline.other_views import along
        from brushgs.pipeline.sequence import paint_prepared

        config, view = film.config, painted.prepared.known_view
        num_frames = max(round(config.seconds * config.fps), 3)
        if config.kind == "clip":
            cameras = [film.cameras[0]] * num_frames
            path = CameraPath(cameras, False, config.fps, "a camera that rests")
        elif film.center is not None and view.eye is not None:  # a view from inside has no orbit
            cameras = sway(film.cameras[0], view, num_frames)
            path = CameraPath(cameras, True, config.fps, "a small circle, inside the scene")
        elif film.center is None:
            path = path_through(
                film.cameras,
                view,
                size=(config.width, config.height),
                seconds=config.seconds,
                fps=config.fps,
                loop=config.loop,
            )
        else:
            path = turn_around(film.cameras[0], film.center, view.up, seconds=config.seconds, fps=config.fps)
        with self._new_file(painted, ".mp4") as target:
            clip = self.clip
            film_of = None if clip is None else clip.film(fps=path.fps, num_frames=len(path.cameras))
            seen = along(painted.prepared, painted.config, path, report, film_of)
            paint_prepared(seen, target, painted.config, report, self._origin(painted))
        return target

    def _origin(self, painted: Painted) -> Origin | None:
        """Metadata of outputs."""
        words = map(without_folders, painted.command)
        return Origin(shlex.join(["brushgs", "render", *words])) if self.writes_metadata else None

    def _options(self, settings: Settings) -> list[str]:
        """Command-line words that paint the same; dropped pictures have their original names."""
        names = {key: one.name for key, one in self.dropped.items()}
        return [*self.options(self._overrides(settings)), *flags_of(settings, names), *self._mark_flags]

    def _overrides(self, settings: Settings) -> dict[str, Any]:
        """The overrides of flags, with the files of marks."""
        return overrides_of(settings, self.known) | {"overpaint.files": self.overpainting.files}

    @property
    def _mark_flags(self) -> list[str]:
        return [word for path in self.overpainting.files for word in ("--marks", str(path))]

    def _facts(
        self, settings: Settings, config: PaintConfig, prepared: Prepared, omitted: Sequence[str]
    ) -> Mapping[str, Any]:
        """Values for the panel: those in force, from settings, command line or look."""
        brushes = config.brushes.names
        return {
            "look": settings.look or self.look,
            "strokes": len(prepared.strokes),
            "keep": config.prune.share(),
            "stroke": settings.stroke,
            "brushes": ", ".join(brushes) if brushes else Path(config.draw.stroke).stem,
            "relief": config.light.relief,
            "lamp": shown_lamp(config.light.lamp),
            "ground": config.ground.ground,
            "palette": None if config.palette is None else config.palette.strength,
            "omitted": list(omitted),
        }

    @contextmanager
    def _new_file(self, painted: Painted, suffix: str) -> "Iterator[Path]":
        """A free name, SCENE-LOOK-1.png and so on; released if the block fails."""
        stem = f"{self.source.name}-{Path(painted.facts['look']).stem}"
        path = reserve(self.folder, stem, suffix)
        try:
            yield path
        except BaseException:
            path.unlink(missing_ok=True)
            raise


def reserve(folder: Path, stem: str, suffix: str) -> Path:
    """Reserve the first free numbered name by an empty file.

    Raises:
        SceneError: if the folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SceneError(folder, f"the folder cannot be made ({error.strerror}); choose another") from None
    for number in count(1):
        path = folder / f"{stem}-{number}{suffix}"
        try:
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        except FileExistsError:
            if number < MAX_NUMBER:
                continue
            raise SceneError(path, "is taken, as all lower numbers are; move some away") from None
        except OSError as error:
            raise SceneError(path, f"cannot be written ({error.strerror}); choose another folder") from None
        return path
    raise AssertionError("count never ends")

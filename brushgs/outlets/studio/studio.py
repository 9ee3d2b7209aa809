"""The state of the viewer's page: painting, running work and written outputs.

Changes of the painting and outputs (pictures and videos) have separate worker threads, so that long videos do
not delay changes. The latest change wins. An output starts when no change is running, and includes all
earlier changes. Every change of the state has a new number, which the page waits for.
"""

import threading
import time
from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from secrets import token_hex
from typing import IO, Any, Literal

from brushgs.formats.pictures.images import read_image
from brushgs.outlets.page.html import page_html
from brushgs.outlets.studio.hearing import Heard
from brushgs.outlets.studio.overpainting import HandStroke
from brushgs.outlets.studio.scenes import Scenes, plain_name
from brushgs.outlets.studio.session import Dropped, Painted, Session
from brushgs.outlets.studio.settings import Film, Settings, Shot, schema
from brushgs.outlets.studio.work import AbandonedError, Lane, Progress, Task, WatchedReport

MAX_OUTPUTS = 32  # waiting or running; more is a faulty page
MAX_DROPPED = 64  # pictures that were dropped
KEPT_OUTPUTS = 200  # that the page may request

Kind = Literal["picture", "video"]
OutputState = Literal["waiting", "running", "done", "failed", "stopped"]
Say = Callable[[str], None]


@dataclass(frozen=True)
class Output:
    """A requested picture or video.

    Attributes:
        key: its id.
        kind: picture or video.
        state: of its work.
        words: size and length.
        progress: while it runs.
        path: of the file, when done.
        error: a sentence, if it failed.
        notes: its warnings.
    """

    key: str
    kind: Kind
    state: OutputState
    words: str
    progress: Progress | None = None
    path: Path | None = None
    error: str | None = None
    notes: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """The output for the page."""
        return {
            "id": self.key,
            "kind": self.kind,
            "state": self.state,
            "words": self.words,
            "progress": _progress(self.progress),
            "name": None if self.path is None else self.path.name,
            "folder": None if self.path is None else str(self.path.resolve().parent),
            "error": self.error,
            "notes": list(self.notes),
        }


class Studio:
    """A session, its work, and its state. All methods may be called by any thread.

    Args:
        session: whose painting is shown.
        first: its first painting.
        uploads: empty folder for dropped pictures while the studio is open.
        heard: scene warnings by thread; or None.
        say: called with the path of each written file.
        others: scenes that the page may open, besides dropped ones.

    Attributes:
        hint: how to reach the page from a headset; or "".
    """

    def __init__(
        self,
        session: Session,
        first: Painted,
        *,
        uploads: Path,
        heard: Heard | None = None,
        say: Say = lambda path: None,
        others: Sequence[Path] = (),
    ) -> None:
        self._session, self._uploads, self._heard = session, uploads, heard or Heard()
        self._say, self.hint = say, ""
        self._changed, self._finding, self._adding = threading.Condition(), threading.Lock(), threading.Lock()
        self._overpainting = threading.Lock()
        self._number, self._is_closed = 1, False
        self._painted, self._version, self._seconds = first, 1, 0.0
        self._wanted = first.settings
        self._scenes = Scenes(session.source, others, uploads)
        self._scene = self._next = next(iter(self._scenes.known))  # shown, and being painted
        self._recent = [self._scene]  # shown so far, the last one first
        self._progress: Progress | None = None
        self._error: str | None = None
        self._notes: tuple[str, ...] = ()
        self._outputs: dict[str, Output] = {}
        self._tasks: dict[str, Task] = {}
        self._changes = Lane("brushgs changes", latest_wins=True)
        self._writing = Lane("brushgs outputs")

    @property
    def session(self) -> Session:
        """The session of the painting."""
        return self._session

    def page(self) -> str:
        """The text of the page, with the current painting."""
        with self._changed:
            contents = self._painted.contents
        return page_html(contents, title=self._session.source.name, live=True)

    def contents(self) -> tuple[int, bytes]:
        """The version of the painting, and the page's contents."""
        with self._changed:
            return self._version, self._painted.contents

    def state(self, known: int = 0, seconds: float = 0.0) -> Mapping[str, Any]:
        """The state for the page, for JSON.

        Args:
            known: the number of the state that the page has.
            seconds: longest wait for another one.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._number != known or self._is_closed, seconds)
            return {
                "number": self._number,
                "version": self._version,
                "scene": self._scene,
                "seconds": round(self._seconds, 2),
                "painting": dict(self._painted.facts),
                "settings": _settings(self._wanted),
                "progress": _progress(self._progress),
                "error": self._error,
                "notes": list(self._notes),
                "marks": self._session.overpainting.facts,
                "outputs": [output.as_json() for output in self._outputs.values()],
            }

    def choices(self) -> Mapping[str, Any]:
        """The choices of the page's controls, for JSON; only dropped pictures change them."""
        from brushgs.brushes.builtin import stroke_notes
        from brushgs.options.look import Look

        known = self._session.known
        looks = [(name, Look.open(name)) for name in known.looks]
        with self._changed:
            dropped = {key: one.name for key, one in self._session.dropped.items()}
            moment = self._session.moment
            scenes = [{"id": key, "name": one.name} for key, one in self._scenes.known.items()]
            recent = list(self._recent)
        return {
            "scenes": scenes,
            "recent": recent,
            "moment": moment,
            "looks": [{"name": name, "title": look.title, "goodFor": look.good_for} for name, look in looks],
            "strokes": [{"name": note.name, "goodFor": note.good_for} for note in stroke_notes()],
            "schema": schema(),
            "dropped": [{"id": key, "name": name} for key, name in dropped.items()],
            "folder": str(self._session.folder.resolve()),
            "hint": self.hint,
        }

    def change(self, settings: Settings) -> int:
        """Start a painting with other settings; it replaces the running one.

        Returns:
            The number of the state.

        Raises:
            ValueError: if a setting is out of range, or the file of options cannot be written; then nothing
                changes.
        """
        self._session.config(settings)
        with self._changed:
            self._session.save(settings)
            # While the state is locked, so that tasks and states have the same order.
            return self._start(settings, self._next)

    def keep_moment(self, seconds: float) -> None:
        """Keep the moment of a clip where the page rests. Raises SceneError if it cannot be written."""
        with self._changed:
            if seconds != self._session.moment:
                self._session.moment = seconds
                self._session.save(self._wanted)

    def open_scene(self, key: str) -> int:
        """Start painting another scene with the same settings but places; the shown one stays if that fails.

        Returns:
            The number of the state.

        Raises:
            ValueError: if there is no such scene.
        """
        with self._changed:
            if key not in self._scenes.known:
                raise ValueError("there is no such scene; reload the page")
            return self._start(self._wanted.of_any_scene, key)

    def add_scene(self, name: str, content: IO[bytes]) -> str:
        """Store a dropped scene, and start painting it; returns its id.

        Raises:
            ValueError: if it is of no format that is read, or there are too many.
        """
        with self._adding:  # without the state: large files take long
            key = self._scenes.add(name, content)
        with self._changed:
            self._start(self._wanted.of_any_scene, key)
        return key

    def _start(self, settings: Settings, scene: str) -> int:
        self._wanted, self._error, self._progress, self._next = settings, None, Progress("waiting"), scene
        self._changes.submit(lambda task: self._paint(settings, scene, task))
        return self._bump()

    def paint_over(self, stroke: HandStroke) -> int | None:
        """Do what a stroke of the page's brush means, write the file of marks, and start the painting.

        Returns:
            The number of the state; None if the stroke meets nothing.

        Raises:
            ValueError: if it is one too many, the scene moves, another scene is being opened, or the file
                cannot be written; then nothing changes.
        """
        return self._change_marks(lambda session, painted: session.paint_over(painted, stroke))

    def step_marks(self, by: int) -> int | None:
        """Undo (-1) or redo (1) a stroke of the page's brush; see `paint_over`."""
        return self._change_marks(lambda session, painted: session.overpainting.step(by))

    def _change_marks(self, change: Callable[[Session, Painted], bool]) -> int | None:
        with self._overpainting:  # one after the other, without the state: a stroke takes a part of a second
            with self._changed:
                session, painted = self._session, self._painted
                if self._next != self._scene:
                    raise ValueError("another scene is being opened; paint when it is there")
            if not change(session, painted):
                return None
            with self._changed:
                session.save(self._wanted)
                return self._start(self._wanted, self._next)

    def shoot(self, shot: Shot) -> str:
        """Start painting a picture; returns the id of the output. Raises ValueError if too many wait."""
        words = f"{shot.camera.width} x {shot.camera.height}"
        return self._add("picture", words, lambda one, report: self._session.shoot(one, shot, report))

    def film(self, film: Film) -> str:
        """Start painting a video; returns the id of the output. Raises ValueError if too many wait."""
        config = film.config
        words = f"{config.width} x {config.height}, {config.seconds:g} s"
        return self._add("video", words, lambda one, report: self._session.film(one, film, report))

    def find(self, text: object) -> dict[str, Any]:
        """The strokes in a part of the scene given as text, for JSON; nothing is painted.

        Returns:
            The version of the painting, `num` of `total` strokes, and for each coat a column of bytes, 0 to
            255 for 0 to 1, as base64.

        Raises:
            ValueError: if it is invalid or does not exist.
        """
        with self._changed:
            painted, version = self._painted, self._version
        with self._finding:  # one at a time: each may use all processors
            found = self._session.find(painted, text)
        columns = [b64encode(column.tobytes()).decode("ascii") for column in found.columns]
        return {"version": version, "num": found.num, "total": found.total, "columns": columns}

    def stop(self, key: str) -> bool:
        """Stop an output; False if it neither waits nor runs."""
        with self._changed:
            output = self._outputs.get(key)
            if output is None or output.state not in ("waiting", "running"):
                return False
            self._tasks[key].abandon()
            if output.state == "waiting":
                self._update(key, state="stopped")
            return True

    def add_file(self, name: str, content: bytes) -> str:
        """Store a dropped picture; returns its id.

        Raises:
            ValueError: if it is not a readable picture, or there are too many.
        """
        if len(self._session.dropped) >= MAX_DROPPED:
            raise ValueError(f"at most {MAX_DROPPED} pictures can be dropped; start the viewer again")
        key = token_hex(8)
        folder = self._uploads / key
        folder.mkdir()
        path = folder / plain_name(name)
        path.write_bytes(content)
        try:
            read_image(path)
        except ValueError as error:
            path.unlink()
            folder.rmdir()
            raise ValueError(f"{name}: {str(error).removeprefix(f'{path}: ')}") from None
        with self._changed:
            # A new dictionary: other threads may be reading the old one.
            self._session.dropped = {**self._session.dropped, key: Dropped(name, path)}
            self._bump()
        return key

    def output(self, key: str) -> Path | None:
        """The file of a finished output."""
        with self._changed:
            output = self._outputs.get(key)
            return None if output is None or output.state != "done" else output.path

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until no work is left; returns False if that takes longer."""
        until = None if seconds is None else time.monotonic() + seconds
        if not self._changes.wait(seconds=seconds):
            return False
        return self._writing.wait(seconds=None if until is None else max(until - time.monotonic(), 0.0))

    def close(self, seconds: float = 10.0) -> bool:
        """Abandon all work, and wait until it has ended; returns False if that takes longer."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
        until = time.monotonic() + seconds
        is_left = self._changes.close(max(until - time.monotonic(), 0.0))
        return self._writing.close(max(until - time.monotonic(), 0.0)) and is_left

    def _paint(self, settings: Settings, scene: str, task: Task) -> None:
        """The work of a change."""
        start = time.perf_counter()

        def watch(progress: Progress) -> None:
            with self._changed:
                task.check()
                self._progress = progress
                self._bump()

        self._heard.take()
        with self._changed:
            session, source = self._session, self._scenes.known[scene].source
            if scene != self._scene:
                session = session.of_scene(source)
        painted, error = None, None
        try:
            painted = session.paint(settings, WatchedReport(watch=watch))
        except AbandonedError:
            raise
        except Exception as caught:
            error = self._sentence(caught)
        notes = tuple(self._heard.take())
        with self._changed:
            task.check()
            self._progress, self._error, self._notes = None, error, notes
            if painted is None:
                if scene != self._scene:
                    self._wanted = self._painted.settings
                self._next = self._scene
            else:
                session.dropped = self._session.dropped  # some may have been dropped meanwhile
                self._session, self._scene = session, scene
                self._recent = [scene, *(one for one in self._recent if one != scene)]
                self._painted, self._version = painted, self._version + 1
                self._seconds = time.perf_counter() - start
            self._bump()

    def _add(self, kind: Kind, words: str, paint: Callable[[Painted, WatchedReport], Path]) -> str:
        with self._changed:
            busy = [one for one in self._outputs.values() if one.state in ("waiting", "running")]
            if len(busy) >= MAX_OUTPUTS:
                raise ValueError(f"at most {MAX_OUTPUTS} pictures and videos can wait; stop some")
            for old in [key for key, one in self._outputs.items() if one not in busy][:-KEPT_OUTPUTS]:
                del self._outputs[old], self._tasks[old]
            key = token_hex(8)
            self._outputs[key] = Output(key, kind, "waiting", words)
            self._tasks[key] = self._writing.submit(lambda task: self._write(key, paint, task))
            self._bump()
            return key

    def _write(self, key: str, paint: Callable[[Painted, WatchedReport], Path], task: Task) -> None:
        """The work of an output."""

        def watch(progress: Progress) -> None:
            task.check()
            self._update(key, progress=progress)

        try:
            self._changes.wait(task)
            with self._changed:
                painted = self._painted
            self._update(key, state="running")
            self._heard.take()
            path = paint(painted, WatchedReport(watch=watch))
        except AbandonedError:
            self._update(key, state="stopped", progress=None)
            raise
        except Exception as caught:
            self._update(key, state="failed", progress=None, error=self._sentence(caught))
        else:
            notes = tuple(self._heard.take())
            self._update(key, state="done", progress=None, path=path, notes=notes)
            self._say(str(path))

    def _sentence(self, error: Exception) -> str:
        """An error for people."""
        if isinstance(error, MemoryError):
            sentence = "out of memory; take a smaller size"
        elif isinstance(error, ValueError | OSError):
            sentence = " ".join(str(error).split())
        else:
            sentence = f"internal error, {type(error).__name__}: {error}"
        for key, one in self._session.dropped.items():  # hide its path
            sentence = sentence.replace(str(one.path), one.name).replace(key, one.name)
        return self._scenes.hide(sentence)

    def _update(self, key: str, **fields: Any) -> None:
        with self._changed:
            self._outputs[key] = replace(self._outputs[key], **fields)
            self._bump()

    def _bump(self) -> int:
        self._number += 1
        self._changed.notify_all()
        return self._number


def _progress(progress: Progress | None) -> dict[str, Any] | None:
    if progress is None:
        return None
    return {"stage": progress.stage, "done": progress.done, "total": progress.total}


def _settings(settings: Settings) -> dict[str, Any]:
    """The changed settings, as the page sends them."""
    from brushgs.outlets.studio.settings import camel

    return {camel(name): value for name, value in settings.given.items()}

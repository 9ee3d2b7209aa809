"""A gallery: a folder with a page for each scene, and an index that shows their pictures."""

import html
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote, urljoin

import msgspec

from brushgs.errors import SceneError
from brushgs.formats.files import replacing
from brushgs.formats.scenes.open_file import find_parts
from brushgs.options.page import PAGE_SUFFIXES
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneSource
from brushgs.outlets.page.export import export_file
from brushgs.outlets.page.html import Preview, content_hash, fill, plain_text, web_text
from brushgs.pipeline.report import Report
from brushgs.version import __version__

INDEX = f"index{PAGE_SUFFIXES[0]}"


@dataclass(frozen=True)
class Entry:
    """A page of a gallery.

    Attributes:
        source: the scene.
        name: of its files, without a suffix; no other entry has it.
    """

    source: SceneSource
    name: str

    @property
    def page(self) -> str:
        """The file of its page."""
        return f"{self.name}{PAGE_SUFFIXES[0]}"

    @property
    def picture(self) -> str:
        """The file of its picture."""
        return f"{self.name}.jpg"


def export_gallery(
    scenes: SceneSource,
    folder: str | Path,
    config: PaintConfig | None = None,
    *,
    title: str | None = None,
    caption: str = "",
    address: str = "",
    options: Sequence[str] = (),
    report: Report | None = None,
) -> Report:
    """Paint each of several scene files to a page of its own.

    Args:
        scenes: each of its files is a scene; a folder stands for the scenes in it.
        folder: where pages, pictures and the index are written; it is made.
        config: of all paintings.
        title: of the index, any text; None for the name of the folder.
        caption: a line below it; "" for none.
        address: of the folder on the web, for link previews; "" for none.
        options: see `export_file`.
        report: gets a stage for each page; a new one if None.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit a scene.
    """
    config, report, folder = config or PaintConfig(), report or Report(), Path(folder)
    entries, base = entries_of(scenes), address and address.rstrip("/") + "/"
    if folder.exists() and not folder.is_dir():
        raise SceneError(folder, "is a file; a gallery needs a folder")
    for entry in entries:
        preview = Preview(address=urljoin(base, quote(entry.page)) if base else "", picture=entry.picture)
        with report.stage(entry.name) as stage:
            page = folder / entry.page
            made = export_file(entry.source, page, config, options=options, preview=preview)
            stage.did = f"{page}: {page.stat().st_size / 1e6:.2f} MB"
            stage.counts = {"path": str(page), "bytes": page.stat().st_size}
            stage.skipped += [note for one in made.stages for note in one.skipped if one.name == "page"]
    with report.stage("index") as stage, replacing(folder / INDEX) as temporary:
        name = plain_text(title if title is not None else folder.resolve().name) or "Gallery"
        preview = Preview(caption, base, entries[0].picture)
        temporary.write_text(index_html(entries, name, preview), encoding="utf-8", newline="\n")
        stage.did, stage.counts = f"{len(entries)} pages", {"pages": len(entries)}
    report.output = str(folder / INDEX)
    return report


def entries_of(scenes: SceneSource) -> list[Entry]:
    """A page for each scene, in their order, see `find_parts`; names that are taken get a number.

    Raises:
        SceneError: if a folder holds no scene.
    """
    entries: list[Entry] = []
    taken = {Path(INDEX).stem}
    for path in find_parts(scenes.paths):
        source = msgspec.structs.replace(scenes, paths=(path,))
        stem = "".join(letter if letter.isalnum() or letter in "-_+." else "_" for letter in source.name)
        name, number = stem, 2
        while name.lower() in taken:
            name, number = f"{stem}-{number}", number + 1
        taken.add(name.lower())
        entries.append(Entry(source, name))
    return entries


def index_html(entries: Sequence[Entry], title: str, preview: Preview) -> str:
    """The text of the index, to be stored as UTF-8; no script is in it."""
    style, caption = web_text("gallery.css"), html.escape(plain_text(preview.caption))
    lines = []
    for entry in entries:
        name = html.escape(entry.source.name)
        picture = f'<img src="{quote(entry.picture)}" alt="{name}, painted" loading="lazy">'
        lines.append(f'<a href="{quote(entry.page)}">{picture}<span>{name}</span></a>\n')
    policy = f"default-src 'none'; img-src 'self' file:; style-src {content_hash(style)}; base-uri 'none'"
    return fill(
        web_text("gallery.html"),
        {
            "title": html.escape(title),
            "policy": html.escape(policy, quote=False),
            "generator": html.escape(f"brushgs {__version__}"),
            "meta": preview.tags(title),
            "style": style,
            "caption": f"<p>{caption}</p>" if caption else "",
            "entries": "".join(lines),
        },
    )

"""The text of a page: the template, the style, the joined scripts with their shaders, and the contents.

The scripts in `web/` are joined here, without a build tool. Nothing from a scene is markup: titles are
escaped, and the contents are base64.
"""

import base64
import hashlib
import html
import json
import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from urllib.parse import quote, urljoin

from brushgs.outlets.page.shared import SHARED, shared_glsl
from brushgs.version import __version__

# In this order: classes are defined before subclasses. Missing files are skipped.
SCRIPTS = (
    "container.js",
    "matrix.js",
    "camera.js",
    "order.js",
    "program.js",
    "smooth.js",
    "levels.js",
    "atlas.js",
    "lines.js",
    "coat.js",
    "moving.js",
    "surface.js",
    "soft_strokes.js",
    "planes.js",
    "blacks.js",
    "space_noise.js",
    "washes.js",
    "wet.js",
    "rub.js",
    "canvas_plan.js",
    "canvas.js",
    "worker.js",
    "made.js",
    "effect_canvas.js",
    "highlight.js",
    "painter.js",
    "orbit.js",
    "pick.js",
    "controls.js",
    "camera_file.js",
    "link.js",
    "stops.js",
    "player.js",
    "panel.js",
    "pace.js",
    "xr.js",
    "live_server.js",
    "live_fields.js",
    "live_outputs.js",
    "live_where.js",
    "live_point.js",
    "live_brush.js",
    "live_scene.js",
    "live.js",
    "drop_brush.js",
    "drop_save.js",
    "drop.js",
    "app.js",
)
# Files for pages with a server only.
LIVE_SCRIPTS = frozenset(name for name in SCRIPTS if name.startswith("live"))
# The scripts of pages that paint, and the text of their worker.
DROP_SCRIPTS, WORKER_SCRIPT = frozenset({"drop_brush.js", "drop_save.js", "drop.js"}), "drop_worker.js"
SHARED_GLSL = "shared.glsl"  # generated, see `brushgs.outlets.page.shared`
SHADER_SUFFIXES = (".vert", ".frag", ".glsl")
_INCLUDE = re.compile(r'^[ \t]*#include "([^"\n]+)"[ \t]*$', re.MULTILINE)
_SLOT = re.compile(r"\{\{(\w+)\}\}")
STILL_TYPES = {b"\xff\xd8\xff": "image/jpeg", b"RIFF": "image/webp", b"\x89PNG": "image/png"}


@dataclass(frozen=True)
class Preview:
    """What a page tells of itself beside its painting: to people, link previews and browser tabs.

    Attributes:
        caption: a line over the picture, any text; "" for none.
        address: where the page will lie; "" if that is not known.
        picture: name of a picture of it, which lies beside it; "" for none.
        icon: a small JPEG; None for none.
    """

    caption: str = ""
    address: str = ""
    picture: str = ""
    icon: bytes | None = None

    @property
    def is_shown(self) -> bool:
        """Whether link previews can show its picture: they take whole addresses only."""
        return bool(self.address and self.picture)

    def tags(self, title: str) -> str:
        """The elements of the head, in the terms of the Open Graph protocol."""
        texts = {
            "og:type": "website",
            "og:title": title,
            "og:description": plain_text(self.caption) or f"{title}, painted with brush strokes",
            "og:url": self.address,
            "og:image": urljoin(self.address, quote(self.picture)) if self.is_shown else "",
        }
        told = {name: html.escape(text) for name, text in texts.items() if text}
        lines = [f'<meta property="{name}" content="{text}">\n' for name, text in told.items()]
        if self.is_shown:
            lines.append('<meta name="twitter:card" content="summary_large_image">\n')
        if self.icon is not None:
            lines.append(f'<link rel="icon" href="{_data_url(self.icon)}">\n')
        return "".join(lines)


def page_html(
    contents: bytes | None,
    *,
    title: str,
    still: bytes | None = None,
    live: bool = False,
    drop: bool = False,
    preview: Preview | None = None,
) -> str:
    """The text of a page, to be stored as UTF-8.

    Args:
        contents: of `write_container`; None for a page that gets them from its server.
        title: any text.
        still: a picture, JPEG, WebP or PNG, for a browser that cannot paint; None for none.
        live: whether the page talks to its server: then it may, and has the studio of `live.js`.
        drop: whether the page paints scene files dropped on it, by the module in its contents.
        preview: see `Preview`.
    """
    preview = preview or Preview()
    script, style = page_script(live=live, drop=drop), web_text("style.css")
    style += (web_text("live.css") if live else "") + (web_text("drop.css") if drop else "")
    own = " 'self'" if live else ""
    worker = " 'wasm-unsafe-eval' blob:" if drop else ""
    policy = "; ".join(
        [
            "default-src 'none'",
            f"script-src {content_hash(script)}{worker}",
            f"style-src {content_hash(style)}",
            f"img-src data: blob:{own}",
            f"connect-src data: blob:{own}",
            "worker-src blob:",  # of effects
            *(["media-src blob: 'self'"] if live else []),
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )
    plain = plain_text(title) or "painting"
    name, caption = html.escape(plain), html.escape(plain_text(preview.caption))
    return fill(
        web_text("page.html"),
        {
            "policy": html.escape(policy, quote=False),
            "generator": html.escape(f"brushgs {__version__}"),
            "title": name,
            "meta": preview.tags(plain),
            "caption": f'<p id="caption">{caption}</p>\n' if caption else "",
            "drop": web_text("drop.html") if drop else "",
            "style": style,
            "still": "" if still is None else _still(still, name),
            "script": script,
            "contents": "" if contents is None else _contents(contents),
        },
    )


def plain_text(text: str) -> str:
    """A text on one line: control characters, line ends and lone surrogates become spaces."""
    shown = (" " if unicodedata.category(letter) in ("Cc", "Zl", "Zp", "Cs") else letter for letter in text)
    return " ".join("".join(shown).split())


def fill(template: str, values: dict[str, str]) -> str:
    """The template with a value in each `{{slot}}`; values are not searched for slots.

    Raises:
        KeyError: if there is no value for a slot.
    """
    return _SLOT.sub(lambda match: values[match[1]], template)


def page_script(*, live: bool = False, drop: bool = False) -> str:
    """All scripts of a page as one: a strict function of its own.

    It begins with the texts of the shaders as `SHADERS`, and `brushgs.outlets.page.shared` as `SHARED`; in a
    page that paints, with the text of its worker as `WORKER`.

    Raises:
        ValueError: if a script holds what would end its element in HTML, or an included file is missing.
    """
    left_out = (set() if live else LIVE_SCRIPTS) | (set() if drop else DROP_SCRIPTS)
    names = [name for name in SCRIPTS if name in web_files() and name not in left_out]
    parts = [
        script_beginning(),
        *([f"const WORKER = {_quoted(web_text(WORKER_SCRIPT))};"] if drop else []),
        *(f"// {name}\n{web_text(name)}" for name in names),
    ]
    script = '(() => {\n"use strict";\n' + "\n".join(parts) + "\n})();\n"
    if re.search(r"</script|<!--", script, re.IGNORECASE):
        raise ValueError("page_script: a script holds '</script' or '<!--'; write it in two parts")
    return script


def script_beginning() -> str:
    """The start of all scripts: the constants `SHADERS` and `SHARED`."""
    return "\n".join(
        f"const {name} = {_quoted(value)};"
        for name, value in (("SHADERS", shaders()), ("SHARED", dict(SHARED)))
    )


def shaders() -> dict[str, str]:
    """The texts of all shaders by the name of their file.

    Lines `#include "name.glsl"` are resolved, the first time that a file is included.
    """
    return {name: _resolved(name, (), set()) for name in web_files() if name.endswith(SHADER_SUFFIXES)}


def web_files() -> list[str]:
    """The names of the files of a page."""
    return sorted(entry.name for entry in _web().iterdir() if entry.is_file())


def _resolved(name: str, within: tuple[str, ...], included: set[str]) -> str:
    if name in within:
        raise ValueError(f"shaders: {' -> '.join((*within, name))} includes itself")
    if name in included:
        return ""
    included.add(name)
    if name == SHARED_GLSL:
        return shared_glsl()
    if name not in web_files():
        raise ValueError(f"shaders: {within[-1] if within else name} includes {name}, which is missing")
    return _INCLUDE.sub(lambda match: _resolved(match[1], (*within, name), included), web_text(name))


def _quoted(value: object) -> str:
    """JSON that is safe within a script element: no "<", and nothing beyond ASCII."""
    return json.dumps(value, indent=0).replace("<", "\\u003c")


def _contents(contents: bytes) -> str:
    text = base64.b64encode(contents).decode("ascii")
    return f'<script type="application/octet-stream" id="contents">{text}</script>\n'


def _still(still: bytes, name: str) -> str:
    return f'<img id="still" alt="{name}" src="{_data_url(still)}">'


def _data_url(picture: bytes) -> str:
    kind = next((kind for begin, kind in STILL_TYPES.items() if picture.startswith(begin)), None)
    if kind is None:
        raise ValueError("page_html: still must be a JPEG, a WebP or a PNG")
    text = base64.b64encode(picture).decode("ascii")
    return f"data:{kind};base64,{text}"


def content_hash(text: str) -> str:
    """The hash of a script or a style, as a content security policy names it."""
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")
    return f"'sha256-{digest}'"


def _web() -> "resources.abc.Traversable":
    return resources.files("brushgs.outlets.page") / "web"


@lru_cache(maxsize=64)
def web_text(name: str) -> str:
    """The text of a file of a page."""
    return (_web() / name).read_text(encoding="utf-8")

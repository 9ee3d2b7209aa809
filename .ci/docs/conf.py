"""Settings of Sphinx for the site of brushgs, whose sources `write_pages.py` collects and writes."""

import ast
import dataclasses
import inspect
import re
import textwrap
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.domains.python import PyObject
from sphinx_gallery.scrapers import figure_rst

import brushgs as bg
from brushgs import __version__

project = "brushgs"
author = "The brushgs authors"
version = release = __version__
extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon", "myst_parser", "sphinx_gallery.gen_gallery"]
html_theme = "furo"
html_title = f"brushgs {__version__}"
html_show_sourcelink = html_copy_source = html_show_copyright = False
default_role = "py:obj"  # docstrings write names in single backticks
add_module_names = False
python_maximum_signature_line_length = 60
autodoc_member_order = "bysource"
autodoc_class_signature = "mixed"
napoleon_google_docstring, napoleon_numpy_docstring = True, False
napoleon_use_ivar = True  # attributes are a list, not entries of their own
napoleon_attr_annotations = False  # their types stand in the text, with shapes and units
smartquotes = False  # in docstrings quotes are those of code
source_suffix = {".rst": "restructuredtext", ".md": "markdown"}
exclude_patterns = ["examples/gallery"]  # of which the gallery is made
myst_heading_anchors = 3
suppress_warnings = ["config.cache"]  # the gallery has a function among its settings


def pictures_of(block: Any, variables: dict[str, Any], settings: dict[str, Any]) -> str:
    """What a block of an example leaves in `picture`, a frame or a list of frames, is shown below it."""
    found = variables["example_globals"].pop("picture", [])
    paths = []
    for frame in found if isinstance(found, list) else [found]:
        paths.append(next(variables["image_path_iterator"]))
        bg.save(frame, paths[-1])
    return str(figure_rst(paths, settings["src_dir"]))


sphinx_gallery_conf = {
    "examples_dirs": str(Path(__file__).parents[2] / "examples" / "gallery"),
    "gallery_dirs": "gallery",
    "image_scrapers": (pictures_of,),
    "reset_modules": (),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_memory": False,
    "thumbnail_size": (400, 300),
    "min_reported_time": 1e6,  # seconds: no times, which differ
}


def signature_of(app: Sphinx, what: str, name: str, value: Any, *_: Any) -> tuple[str, str] | None:
    """The signature as the source has it: names of types, such as `Array`, say more than what they mean."""
    if dataclasses.is_dataclass(value):
        return _arguments_of_class(value), ""
    if not inspect.isroutine(value):
        return None
    function = ast.parse(textwrap.dedent(inspect.getsource(value))).body[0]
    assert isinstance(function, ast.FunctionDef)
    arguments = function.args
    if "." in name.removeprefix("brushgs.") and arguments.args and arguments.args[0].arg in ("self", "cls"):
        del arguments.args[0]
    for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
        argument.annotation = _unquoted(argument.annotation)
    defaults = {p.name: p.default for p in inspect.signature(value).parameters.values()}
    for of_kind, given in (
        (arguments.args, arguments.defaults),
        (arguments.kwonlyargs, arguments.kw_defaults),
    ):
        for number, (argument, default) in enumerate(
            zip(of_kind[len(of_kind) - len(given) :], given, strict=True)
        ):
            if isinstance(default, ast.Name | ast.Subscript):  # a named constant: its value says more
                given[number] = ast.parse(repr(defaults[argument.arg]), mode="eval").body
    returned = _unquoted(function.returns)
    return f"({ast.unparse(arguments)})", "" if returned is None else ast.unparse(returned)


def _arguments_of_class(value: Any) -> str:
    """Names and defaults; what they are stands under Attributes."""
    parameters = [
        parameter.replace(annotation=inspect.Parameter.empty)
        for parameter in inspect.signature(value).parameters.values()
    ]
    return str(inspect.Signature(parameters)).replace("<factory>", "...")


def _unquoted(annotation: ast.expr | None) -> ast.expr | None:
    """A type that the source has in quotes, without them."""
    if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
        return ast.parse(annotation.value, mode="eval").body
    return annotation


def plain_text(app: Sphinx, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Escape what docstrings mean as it is, |x| and *, outside of names in backticks and examples."""
    for number, line in enumerate(lines):
        if not line.lstrip().startswith((">>>", "...")):
            parts = line.split("`")
            parts[::2] = [re.sub(r"(?<!\*)\*(?!\*)|\|", r"\\\g<0>", part) for part in parts[::2]]
            lines[number] = "`".join(parts)
    for number, line in enumerate(lines[:-1]):
        if line.strip() == "Returns:":  # its text has no type before a colon: that stands in the signature
            indent = len(lines[number + 1]) - len(lines[number + 1].lstrip())
            lines[number + 1] = f"{' ' * indent}: {lines[number + 1].lstrip()}"


def setup(app: Sphinx) -> None:
    """Connect the handlers; text is escaped before napoleon reads it."""
    next(f for f in PyObject.doc_field_types if f.name == "variable").label = "Attributes"
    app.connect("autodoc-process-signature", signature_of)
    app.connect("autodoc-process-docstring", plain_text, priority=1)

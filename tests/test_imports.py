"""Imports point one way, and a command loads only what it uses."""

import ast
import subprocess
import sys
from pathlib import Path

import brushgs
from brushgs.cli.parser import COMMANDS
from tests.kit.for_each import for_each

PACKAGE = Path(__file__).resolve().parent.parent / "brushgs"
# A module may import from its own layer and from those above it in this list.
LAYERS = [
    ["version", "errors"],
    ["core"],
    ["options"],
    ["values"],
    ["formats"],
    ["brushes", "cameras", "still_life"],
    ["rendering"],
    ["passes"],
    ["autograd", "first_view"],
    ["stroke_count"],
    ["pipeline"],
    ["outlets"],
    ["doctor", "measure"],
    ["refine"],
    ["cli"],
    ["keywords", "by_keywords"],
    ["__main__"],
]
LAYER_OF = {name: number for number, names in enumerate(LAYERS) for name in names}


def package_imports(path):
    """Top names under `brushgs` that a file imports, also inside functions and for type checks."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "brushgs":
            rest = node.module.split(".")[1:]
            yield from [rest[0]] if rest else [alias.name for alias in node.names]
        elif isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name.startswith("brushgs."):
                    yield alias.name.split(".")[1]


SOURCES = sorted(
    p for p in PACKAGE.rglob("*.py") if p != PACKAGE / "__init__.py" and "strokes" not in p.parts
)


@for_each("path", SOURCES)
def test_imports_point_to_the_same_or_an_earlier_layer(path):
    own = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
    assert own in LAYER_OF, f"{own} is in no layer; add it to LAYERS"
    for other in package_imports(path):
        if other == "_core":
            assert own == "core", f"{own} imports the core itself; take it from brushgs.core.native"
            continue
        assert LAYER_OF[other] <= LAYER_OF[own], f"{own} imports {other}, which comes later"


def test_type_checkers_see_the_public_names_where_they_are_imported_from():
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {alias.asname: node.module for node in block.body for alias in node.names}
    assert seen == {name: f"brushgs.{module}" for name, module in brushgs._MODULE_OF.items()}
    for name in brushgs.__all__:
        assert getattr(brushgs, name) is not None


def loaded_by(code):
    """Names of the top-level modules that a fresh interpreter holds after some code."""
    tail = "\nimport sys; print(' '.join(sorted({m.split('.')[0] for m in sys.modules})), file=sys.stderr)"
    run = subprocess.run(
        [sys.executable, "-c", code + tail], capture_output=True, text=True, check=True, cwd=PACKAGE.parent
    )
    return set(run.stderr.split())


HEAVY = {"numpy", "scipy", "sklearn", "skimage", "OpenImageIO", "av", "rich", "torch", "matplotlib"}
HEAVY |= {"dataclasses"}  # imports inspect: longer than the rest of `--help`
WORDS = [["--help"], ["--version"], *([name, "--help"] for name in COMMANDS)]


def test_help_loads_nothing_heavy():
    """Of all commands in one process: what one of them loads, all have loaded."""
    code = f"import brushgs.cli\nfor words in {WORDS!r}:\n    try: brushgs.cli.main(words)\n"
    code += "    except SystemExit as e: assert e.code == 0, words"
    assert not loaded_by(code) & HEAVY


def test_a_bad_flag_is_refused_before_anything_heavy_is_loaded():
    code = "import brushgs.cli\nimport sys, io\nerr, sys.stderr = sys.stderr, io.StringIO()\n"
    code += "assert brushgs.cli.main(['render', 'a.ply', '--size', '12']) == 2\nsys.stderr = err"
    assert not loaded_by(code) & HEAVY


PAINT = """
import brushgs.cli, brushgs as bg, os, sys
from brushgs.still_life import still_life
os.chdir(FOLDER)
bg.save(still_life(1000), "a.ply")
words = "render a.ply -o a.png --stroke swirl --strokes 100 --size 32x24 --quiet"
assert brushgs.cli.main(words.split()) == 0
layers = [f"brushgs.rendering.{name}" for name in ("layers", "fragments", "mattes", "deep")]
assert not set(layers) & set(sys.modules)
assert not {m.split(".")[0] for m in sys.modules} & {"scipy", "sklearn"}  # longer than what they would do
words = ["prune", "a.ply", "-o", "b.ply", "--where", "height:10%.. or half:1,0,0,0"]
words += ["--text-model", "nowhere"]
assert brushgs.cli.main([*words, "--quiet"]) == 0
"""


def test_painting_loads_no_torch_no_layers_and_no_table_library_when_quiet(tmp_path):
    """Nor does a part that is named without words."""
    loaded = loaded_by(f"FOLDER = {str(tmp_path)!r}\n{PAINT}")
    assert "numpy" in loaded
    assert not loaded & {"torch", "kornia", "open3d", "trimesh", "dask", "rich", "av", "skimage"}
    assert not loaded & {"transformers", "safetensors", "tokenizers"}

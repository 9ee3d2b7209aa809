"""Results outlive a call where somebody holds them; what modules keep by themselves is listed, with why."""

import ast
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent / "brushgs"
FOLDERS = "pipeline", "passes", "rendering"
MAKERS = {"WeakKeyDictionary", "WeakValueDictionary", "ContextVar", "Counter", "dict", "list", "set"}
KEPT = {
    "pipeline/runner.py _held": "the memory that a batch gives to its jobs",
    "pipeline/where.py _finder": "a CLIP model, opened once; by its folder",
    "passes/add/ground_maps.py _weights": "by the side of a map and the width of its blur",
    "passes/color/color_space.py _curves": "numbers that follow from constants",
    "passes/where/evaluate.py _known": "of a scene and a view, and gone with these",
    "rendering/paths.py _covers": "where a brush covers its box, by the brush, of which a painting has few",
    "rendering/paths.py _solid": "how much of its box a brush covers, by the brush",
    "rendering/wet_layer.py ragged_border": "by the size of the picture",
    "rendering/relief.py _at_rest": "of strokes that moved those at rest, whichever frame came first",
    "rendering/relief.py _cache": "of strokes, and gone with them; by all that it depends on",
    "rendering/streaks.py noise": "numbers that follow from constants",
    "rendering/streaks.py packed_noise": "numbers that follow from constants",
    "rendering/surface.py _linen": "by the size and the seed of the weave",
    "rendering/surface.py _paper": "by the size and the seed of the grain",
    "rendering/texture_levels.py _cache": "mip levels of a stroke image, and gone with it",
}


def kept_by(path):
    """Names at the top of a module that keep something from call to call: caches, and what is no constant."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef):
            decorators = {ast.unparse(one).split("(")[0].split(".")[-1] for one in node.decorator_list}
            if decorators & {"cache", "lru_cache"}:
                yield node.name
        elif isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            made = node.value.func if isinstance(node.value, ast.Call) else None
            name = ast.unparse(made).split("[")[0].split(".")[-1] if made is not None else ""
            is_open = name in MAKERS or isinstance(node.value, ast.Dict | ast.List | ast.Set)
            yield from (
                ast.unparse(one) for one in targets if is_open and not ast.unparse(one).strip("_").isupper()
            )


def test_no_module_keeps_a_result_but_those_with_a_reason():
    found = set()
    for folder in FOLDERS:
        for path in (PACKAGE / folder).rglob("*.py"):
            names = set(kept_by(path)) - {"__all__"}
            found |= {f"{path.relative_to(PACKAGE).as_posix()} {name}" for name in names}
    assert found == set(KEPT), "give the reason here, or hold it in a Memory"


def test_a_cache_would_be_seen(tmp_path):
    path = tmp_path / "module.py"
    path.write_text("_seen = {}\nTABLE = {1: 2}\n\n@lru_cache(maxsize=2)\ndef found():\n    return 1\n")
    assert set(kept_by(path)) == {"_seen", "found"}

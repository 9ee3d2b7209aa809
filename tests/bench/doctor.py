"""What `brushgs doctor` finds: python -m tests.bench.doctor [--scenes NAME ...] [--shares 0.01 0.001].

Tables in Markdown. Sound: what is found in each scene as it is. Planted: each fault, planted into each scene;
a cell is "yes" where the finding of that name is there, and names whatever else of severity fault or odd
came up that the sound scene does not have. Floaters: recall and precision. Pictures: what dropping the own
floaters of a scene does to them. Missing scenes are skipped; the still life is always there.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

import brushgs as bg
from brushgs.cameras.framing import AXES, frame_scene
from brushgs.doctor import Examination, examine_file, run_doctor
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, PruneConfig
from brushgs.passes.extent import robust_frame
from brushgs.pipeline.still import paint
from brushgs.still_life import still_life, still_life_camera
from tests.bench.machine import describe
from tests.doctor import plant
from tests.scenes import SCENES_FOLDER

SCENES = {
    "still life": "-y", "koala.ply": "-y", "rubber_toy_cloud.ply": "+y", "sunflower_tile.ply": "+z",
    "derived/truck.ply": "-y", "derived/chair.ply": "+z", "biker.compressed.ply": "-y",
    "derived/skull_sh3.ply": "-y", "derived/playbot_sh2.ply": "-y", "derived/campsite.ply": "-y",
}  # fmt: skip
VIEWS, SIZE = (30, 150, 270), (400, 300)
PICTURE = (135, 180)
CLEAR = 0.08  # radii of the scene from anything, beyond both their sizes: a floater that all would call one


def scenes(wanted: list[str] | None, names: Iterable[str] = SCENES) -> Iterator[tuple[str, bg.Gaussians]]:
    for name in names:
        if wanted and not any(part in name for part in wanted):
            continue
        if name == "still life":
            yield name, still_life()
        elif (SCENES_FOLDER / name).exists():
            yield name, bg.load(SCENES_FOLDER / name)


def serious(examination: Examination) -> set[str]:
    return {f.name for f in examination.findings if f.severity != "note"}


def print_row(*cells: object) -> None:
    print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)


def sound_row(name: str, gaussians: bg.Gaussians, tmp: Path) -> Examination:
    path = plant.write(plant.nothing(plant.columns_of(gaussians, tmp)), tmp / "sound.ply")
    start = time.perf_counter()
    examination = examine_file(path)
    seconds = time.perf_counter() - start
    found = {s: [f for f in examination.findings if f.severity == s] for s in ("fault", "odd", "note")}
    words = [", ".join(f"{f.name} {f.count}" for f in found[s]) or "-" for s in ("fault", "odd")]
    notes = ", ".join(f.name for f in found["note"] if f.name not in ("up-axis", "unit")) or "-"
    up = next(f.facts for f in found["note"] if f.name == "up-axis")
    print_row(name, f"{len(gaussians):,}", *words, notes, f"{up['up']} {up['confidence']}", f"{seconds:.1f}")
    return examination


def cell(name: str, planted: plant.Planted, before: set[str], tmp: Path) -> str:
    examination = examine_file(plant.write(planted, tmp / "planted.ply"))
    finding = next((f for f in examination.findings if f.name == name), None)
    others = serious(examination) - before - {name}
    text = "NO" if finding is None else "yes"
    if finding is not None and not planted.rows.all():
        text = f"{finding.count} of {planted.rows.sum()}"
    return text + "".join(f", also {other}" for other in sorted(others))


def planted_rows(
    name: str, gaussians: bg.Gaussians, before: set[str], shares: list[float], tmp: Path
) -> None:
    columns = plant.columns_of(gaussians, tmp)
    for fault, ways in plant.WHOLE.items():
        print_row(name, fault, "all", "; ".join(cell(fault, way(columns), before, tmp) for way in ways))
    for fault, way in plant.SOME.items():
        if fault != "floaters":
            for share in shares:
                print_row(name, fault, f"{share:.1%}", cell(fault, way(columns, share), before, tmp))


def floater_rows(
    name: str, gaussians: bg.Gaussians, sound: Examination, shares: list[float], tmp: Path
) -> None:
    columns = plant.columns_of(gaussians, tmp)
    own = next((f.rows for f in sound.findings if f.name == "floaters" and f.rows is not None), None)
    body = gaussians if own is None else gaussians.take(~own)
    tree, (_, radius) = cKDTree(body.means), robust_frame(gaussians.means)
    for share in shares:
        planted = plant.floaters(columns, share)
        path = plant.write(planted, tmp / "planted.ply")
        finding = next((f for f in examine_file(path).findings if f.name == "floaters"), None)
        rows = np.zeros(len(planted.rows), bool) if finding is None or finding.rows is None else finding.rows
        strays = bg.load(path).take(planted.rows)
        distances, near = tree.query(strays.means)
        reach = 2 * (strays.scales.max(axis=1) + body.scales[near].max(axis=1))
        is_clear = distances > np.maximum(reach, CLEAR * radius)
        hit = rows[planted.rows]
        known = 0 if own is None else int(own.sum())
        false = int((rows[: planted.num_before] & ~(False if own is None else own)).sum())
        precision = hit.sum() / max(hit.sum() + false, 1)
        recall = f"{hit.mean():.1%}", f"{hit[is_clear].mean():.1%} of {is_clear.sum()}"
        print_row(name, f"{share:.1%}, {len(hit)}", *recall, f"{precision:.1%}", known, false)


def psnr_row(name: str, gaussians: bg.Gaussians, sound: Examination) -> None:
    """What dropping a scene's own floaters does to its pictures, where the subject is and elsewhere."""
    rows = next((f.rows for f in sound.findings if f.name == "floaters" and f.rows is not None), None)
    if rows is None:
        print_row(name, 0, "unchanged", "unchanged")
        return
    texture, inside, outside = bg.StrokeTexture.open("gaussian"), [], []
    kept, dropped = gaussians.take(~rows), gaussians.take(rows)
    for azimuth in VIEWS:
        camera = frame_scene(
            gaussians, width=SIZE[0], height=SIZE[1], up=AXES[SCENES[name]], azimuth=np.radians(azimuth)
        )
        pictures = [bg.render(g, camera, texture) for g in (gaussians, kept, dropped)]
        errors = np.square(pictures[0].over((1, 1, 1)) - pictures[1].over((1, 1, 1))).mean(axis=2)
        solid = pictures[1].alpha > 0.9
        inside.append(errors[solid])
        outside.append(errors[~solid])
    levels = [-10 * np.log10(max(float(np.concatenate(e).mean()), 1e-12)) for e in (inside, outside)]
    print_row(name, int(rows.sum()), *(f"{level:.1f}" for level in levels))


def draw(folder: Path, tmp: Path) -> None:
    """The still life with floaters planted, and cured: plain, and painted with a dry brush."""
    from skimage.transform import resize

    planted = plant.floaters(plant.columns_of(still_life(), tmp), 0.01)
    run_doctor(plant.write(planted, tmp / "before.ply"), tmp / "after.ply")
    camera = still_life_camera(width=800, height=600)
    for name in ("before", "after"):
        for stroke, strokes in (("gaussian", None), ("dry_brush", 2000)):
            config = PaintConfig(
                prune=PruneConfig(keep=0.7 if strokes else 1.0),
                cluster=ClusterConfig(strokes=strokes),
                draw=DrawConfig(stroke=stroke),
            )
            picture = paint(bg.load(tmp / f"{name}.ply"), config, camera=camera).over((1, 1, 1))
            small = resize(np.clip(picture, 0, 1), PICTURE, anti_aliasing=True).astype(np.float32)
            frame = bg.Frame(small, np.ones(PICTURE, np.float32))
            bg.save(frame, folder / f"doctor-{name}-{stroke}.png")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", nargs="*", help="parts of their names, default all")
    parser.add_argument("--shares", nargs="*", type=float, default=[0.01, 0.001])
    parser.add_argument("--only", nargs="*", default=["sound", "planted", "floaters", "pictures"])
    parser.add_argument(
        "--draw", type=Path, metavar="FOLDER", help="only draw the pictures of the still life"
    )
    args = parser.parse_args()
    print(describe(), file=sys.stderr)
    with tempfile.TemporaryDirectory() as folder:
        tmp, looked = Path(folder), {}
        if args.draw:
            draw(args.draw, tmp)
            return
        print_row("scene", "Gaussians", "faults", "odd", "notes", "up", "seconds")
        print_row(*["---"] * 7)
        for name, gaussians in scenes(args.scenes):
            looked[name] = sound_row(name, gaussians, tmp)
        if "planted" in args.only:
            print()
            print_row("scene", "planted", "rows", "found")
            print_row(*["---"] * 4)
            for name, gaussians in scenes(args.scenes):
                planted_rows(name, gaussians, serious(looked[name]), args.shares, tmp)
        if "floaters" in args.only:
            print()
            print_row("scene", "planted", "recall", "recall, clear of all", "precision", "own", "false")
            print_row(*["---"] * 7)
            for name, gaussians in scenes(args.scenes):
                floater_rows(name, gaussians, looked[name], args.shares, tmp)
        if "pictures" in args.only:
            print()
            print_row("scene", "dropped", "PSNR on the solid", "PSNR elsewhere")
            print_row(*["---"] * 4)
            for name, gaussians in scenes(args.scenes):
                psnr_row(name, gaussians, looked[name])


if __name__ == "__main__":
    main()

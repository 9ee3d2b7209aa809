"""Keywords of functions that paint; written by .ci/keywords."""

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Literal, TypedDict

class PaintKeywords(TypedDict, total=False):
    lod: int | str | None
    time: float | str | None
    moments_per_second: float | str | None
    preset: Literal["0.1", "default", "paper"] | None
    quality: Literal["draft", "good", "final"] | None
    ground: str | None
    backdrop: int | bool | str | None
    stage_tone: str | None
    shadow: float | str | None
    chroma: float | str | None
    pigments: int | str | None
    values: float | str | None
    relief: float | str | None
    lamp: Sequence[float] | str | None
    key: float | str | None
    sun: Sequence[float] | str | None
    gloss: float | str | None
    canvas: Literal["none", "linen", "paper"] | None
    stroke: Sequence[str] | str | None
    stroke_color: Literal["own", "scene", "mix"] | None
    filter: Literal["mip", "bilinear", "nearest"] | None
    extent: Literal["fitted", "paper"] | None
    background: str | None
    order: Literal["depth", "soft"] | None
    underpaint: bool | str | None
    streaks: float | str | None
    threads: int | str | None
    keep: float | str | None
    weight: Literal["contribution", "paper"] | None
    clean: Literal["off", "floaters", "sure", "strong"] | None
    strokes: int | str | None
    stroke_size: float | str | None
    features: Literal["balanced", "paper"] | None
    merge: Literal["cover", "paper"] | None
    method: Literal["auto", "lloyd", "minibatch"] | None
    seed: int | str | None
    memory: int | str | None
    strokes_for: Literal["scene", "view"] | None
    see: Literal["views", "off"] | None
    focus: Sequence[float] | str | None
    solid: bool | str | None
    direction: str | None
    broken_color: float | str | None
    economy: float | str | None
    edges: float | str | None
    depth_of_field: float | str | None
    map: Sequence[str] | str | None
    palette: PathLike[str] | str | None
    palette_strength: float | str | None
    palette_space: Literal["lab", "linear", "srgb"] | None
    style: PathLike[str] | Mapping[str, float] | str | None
    adjust: Mapping[str, float] | str | None
    swap: Sequence[str] | str | None
    rules: PathLike[str] | str | None
    marks: Sequence[PathLike[str] | str] | str | None
    continue_: bool | None
    where: str | None
    where_soft: float | str | None
    text_model: PathLike[str] | str | None
    size: Sequence[int] | str | None
    camera_file: PathLike[str] | str | None
    view: int | str | None
    up: Sequence[float] | str | None
    azimuth: float | str | None
    elevation: float | str | None
    from_: Literal["front", "left", "back", "right", "top", "three-quarter"] | None
    look_at: Sequence[float] | str | None
    distance: float | str | None
    pan: Sequence[float] | str | None
    roll: float | str | None
    fov_deg: float | str | None
    zoom: float | str | None
    projection: Literal["perspective", "equirect"] | None
    stereo: Literal["side", "top", "vr180"] | None
    ipd: float | str | None
    lock: Literal["track", "anchor", "canonical", "off"] | None
    first: float | str | None
    layers: Sequence[str] | str | None
    crop: Sequence[int] | str | None
    deep: bool | None

class FilmKeywords(TypedDict, total=False):
    lod: int | str | None
    moments_per_second: float | str | None
    preset: Literal["0.1", "default", "paper"] | None
    quality: Literal["draft", "good", "final"] | None
    ground: str | None
    backdrop: int | bool | str | None
    stage_tone: str | None
    shadow: float | str | None
    chroma: float | str | None
    pigments: int | str | None
    values: float | str | None
    relief: float | str | None
    lamp: Sequence[float] | str | None
    key: float | str | None
    sun: Sequence[float] | str | None
    gloss: float | str | None
    canvas: Literal["none", "linen", "paper"] | None
    stroke: Sequence[str] | str | None
    stroke_color: Literal["own", "scene", "mix"] | None
    filter: Literal["mip", "bilinear", "nearest"] | None
    extent: Literal["fitted", "paper"] | None
    background: str | None
    order: Literal["depth", "soft"] | None
    underpaint: bool | str | None
    streaks: float | str | None
    threads: int | str | None
    keep: float | str | None
    weight: Literal["contribution", "paper"] | None
    clean: Literal["off", "floaters", "sure", "strong"] | None
    strokes: int | str | None
    stroke_size: float | str | None
    features: Literal["balanced", "paper"] | None
    merge: Literal["cover", "paper"] | None
    method: Literal["auto", "lloyd", "minibatch"] | None
    seed: int | str | None
    memory: int | str | None
    strokes_for: Literal["scene", "view"] | None
    see: Literal["views", "off"] | None
    focus: Sequence[float] | str | None
    solid: bool | str | None
    direction: str | None
    broken_color: float | str | None
    economy: float | str | None
    edges: float | str | None
    depth_of_field: float | str | None
    map: Sequence[str] | str | None
    palette: PathLike[str] | str | None
    palette_strength: float | str | None
    palette_space: Literal["lab", "linear", "srgb"] | None
    style: PathLike[str] | Mapping[str, float] | str | None
    adjust: Mapping[str, float] | str | None
    swap: Sequence[str] | str | None
    rules: PathLike[str] | str | None
    marks: Sequence[PathLike[str] | str] | str | None
    continue_: bool | None
    where: str | None
    where_soft: float | str | None
    text_model: PathLike[str] | str | None
    size: Sequence[int] | str | None
    camera_file: PathLike[str] | str | None
    view: int | str | None
    up: Sequence[float] | str | None
    azimuth: float | str | None
    elevation: float | str | None
    from_: Literal["front", "left", "back", "right", "top", "three-quarter"] | None
    look_at: Sequence[float] | str | None
    distance: float | str | None
    pan: Sequence[float] | str | None
    roll: float | str | None
    fov_deg: float | str | None
    zoom: float | str | None
    projection: Literal["perspective", "equirect"] | None
    stereo: Literal["side", "top", "vr180"] | None
    ipd: float | str | None
    orbit: int | str | None
    sway: float | str | None
    path: PathLike[str] | str | None
    frames: int | str | None
    seconds: float | str | None
    fps: float | str | None
    loop: bool | None
    lock: Literal["track", "anchor", "canonical", "off"] | None
    jobs: int | str | None
    scheduler: str | None
    workers_timeout: float | str | None
    resume: bool | None
    hold: int | str | None
    hold_camera: bool | None
    boil: float | str | None
    boil_every: int | str | None
    redraw: float | str | None
    redraw_from: PathLike[str] | str | None
    smear: float | str | None
    start: float | str | None
    end: float | str | None
    speed: float | str | None
    cross_fade: float | str | None
    layers: Sequence[str] | str | None
    crop: Sequence[int] | str | None
    deep: bool | None
    colorspace: Literal["lin_srgb", "srgb", "acescg", "aces2065_1", "lin_rec2020", "lin_p3d65"] | None
    sidecar: bool | None
    codec: Literal["h264", "h265", "prores", "vp9"] | None
    bits: int | str | None
    no_clobber: bool | None
    no_metadata: bool | None

"""CLIP from a folder of the user, as an `Encoder`: patches of pictures and words in one space.

The library is `transformers`, imported when a model is opened. Weights are read only as safetensors: a pickle
can run code. No file outside the folder is read, and no network is used.

CLIP is trained to describe whole pictures. The value path of its last attention layer, without the attention,
describes single patches.
Sources: Radford et al. 2021, CLIP; Zhou et al. 2022, MaskCLIP (features of patches).
"""

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
from msgspec import Meta, Struct

from brushgs.errors import SceneError
from brushgs.formats.files import exists, is_dir, is_plain, read_whole
from brushgs.formats.schema import MAX_BYTES, decode, shown
from brushgs.values.arrays import F32, F64

T = TypeVar("T")
PICKLES = (".bin", ".pt", ".pth", ".ckpt", ".pkl", ".h5", ".msgpack")  # formats of weights that are not read
WEIGHTS = ("model.safetensors", "model.safetensors.index.json")
# Normalization of CLIP's training pictures, for folders without a preprocessor_config.json.
MEAN, DEVIATION = (0.48145466, 0.4578275, 0.40821073), (0.26862954, 0.26130258, 0.27577711)
BATCH = 8  # windows at once: a base model at 224 pixels takes 1.1 GB in all
BRING = "a folder with config.json, model.safetensors, tokenizer.json and preprocessor_config.json"
MODEL = f"bring CLIP as {BRING}, as CLIPModel and CLIPProcessor of transformers save it"


class ClipEncoder:
    """A CLIP model with a vision transformer.

    Attributes:
        side: of its windows, patches.
        patch: side of a patch, pixels.
    """

    def __init__(self, folder: str | Path) -> None:
        """Open the model in a folder.

        Args:
            folder: with the files that `CLIPModel` and `CLIPTokenizer` of transformers save: config.json,
                model.safetensors, tokenizer.json or vocab.json and merges.txt, and preprocessor_config.json
                unless its numbers are those of the first CLIP.

        Raises:
            SceneError: with the cure, if a file is missing or invalid, the weights are a pickle, or a library
                is missing.
        """
        self._folder = Path(folder)
        vision = _checked(self._folder)
        self._mean, self._deviation = _normalization(self._folder)
        self.patch = vision.patch_size
        self.side = vision.image_size // self.patch
        self._model, self._tokenizer = _opened(self._folder)

    def of_words(self, words: Sequence[str]) -> F64:
        """[T, D] unit vectors of T phrases.

        Raises:
            ValueError: if a phrase has more tokens than the model takes.
        """
        import torch

        most = self._model.config.text_config.max_position_embeddings
        tokens = self._tokenizer(list(words), padding=True, return_tensors="pt")
        if tokens["input_ids"].shape[1] > most:
            raise ValueError(f"text: must be at most {most} tokens of {self._folder.name}; take fewer words")
        with torch.inference_mode():
            pooled = self._model.text_model(**tokens).pooler_output
            found = self._model.text_projection(pooled)
        return _unit(found.double().numpy())

    def of_windows(self, windows: F32) -> F64:
        """[B, side, side, D] unit vectors of the patches of B windows, see `Encoder`."""
        import torch

        normalized = ((windows - self._mean) / self._deviation).astype(np.float32)
        pixels = torch.from_numpy(np.ascontiguousarray(normalized.transpose(0, 3, 1, 2)))
        with torch.inference_mode():
            found = torch.cat([self._of_patches(some) for some in pixels.split(BATCH)])
        grid = found.reshape(len(windows), self.side, self.side, -1)
        return _unit(grid.double().numpy())

    def of_pictures(self, windows: F32) -> F64:
        """[B, D] unit vectors of B whole pictures [B, side * patch, side * patch, 3], 0 to 1."""
        import torch

        normalized = ((windows - self._mean) / self._deviation).astype(np.float32)
        pixels = torch.from_numpy(np.ascontiguousarray(normalized.transpose(0, 3, 1, 2)))
        with torch.inference_mode():
            pooled = [self._model.vision_model(some).pooler_output for some in pixels.split(BATCH)]
            found = self._model.visual_projection(torch.cat(pooled))
        return _unit(found.double().numpy())

    def _of_patches(self, pixels: Any) -> Any:
        vision, before = self._model.vision_model, []
        last = vision.encoder.layers[-1]
        hook = last.register_forward_pre_hook(lambda _, arguments: before.append(arguments[0]))
        try:
            vision(pixels)
        finally:
            hook.remove()
        values = last.self_attn.out_proj(last.self_attn.v_proj(last.layer_norm1(before[0])))
        return self._model.visual_projection(vision.post_layernorm(values[:, 1:]))  # the first is the picture


class _Vision(Struct):
    patch_size: Annotated[int, Meta(ge=1, le=64, description="1 to 64 pixels")] = 32
    image_size: Annotated[int, Meta(ge=1, le=1024, description="1 to 1024 pixels")] = 224


class _Config(Struct):
    model_type: Any = None
    vision_config: _Vision | None = None


_Positive = Annotated[float, Meta(gt=0)]


class _Pictures(Struct):
    image_mean: tuple[float, float, float] = MEAN
    image_std: tuple[_Positive, _Positive, _Positive] = DEVIATION


def _read(path: Path, kind: type[T]) -> T:
    return decode(path, read_whole(path, MAX_BYTES), kind, MODEL)


def _checked(folder: Path) -> _Vision:
    """Check the folder and read its configuration, before any heavy import."""
    if not is_dir(folder):
        what = "is a file, not the folder of a CLIP model" if exists(folder) else "is no folder"
        raise SceneError(folder, f"{what}; {MODEL}")
    if not is_plain(folder / "config.json"):
        raise SceneError(folder, f"has no config.json; {MODEL}")
    path = folder / "config.json"
    config = _read(path, _Config)
    if config.model_type != "clip":
        rule = f"must be the configuration of a model of the type 'clip', got {shown(config.model_type)}"
        raise SceneError(path, f"{rule}; other models are not read: {MODEL}")
    vision = config.vision_config or _Vision()
    if vision.patch_size > vision.image_size:
        raise SceneError(path, f"vision_config.patch_size exceeds image_size; {MODEL}")
    _check_files(folder)
    return vision


def _check_files(folder: Path) -> None:
    names = sorted(path.name for path in folder.iterdir())
    if "adapter_config.json" in names:
        raise SceneError(folder, "is an adapter to another model; merge it, and save the whole model")
    if not any(name in names for name in WEIGHTS):
        pickles = [name for name in names if name.endswith(PICKLES)]
        if pickles:
            cure = "save the weights as safetensors where you trust them: "
            cure += "transformers.CLIPModel.from_pretrained(FOLDER).save_pretrained(OTHER)"
            rule = (
                f"holds its weights as {pickles[0]}, which can be a pickle that runs code: it is not opened"
            )
            raise SceneError(folder, f"{rule}; {cure}")
        raise SceneError(folder, f"has no weights: {WEIGHTS[0]} is missing; {MODEL}")
    if "tokenizer.json" not in names and not {"vocab.json", "merges.txt"} <= set(names):
        raise SceneError(folder, f"has no tokenizer.json, and no vocab.json with merges.txt; {MODEL}")


def _normalization(folder: Path) -> tuple[F32, F32]:
    """Mean and deviation of pictures, [3] each, as the model was trained with."""
    path = folder / "preprocessor_config.json"
    if not is_plain(path):
        return np.array(MEAN, np.float32), np.array(DEVIATION, np.float32)
    stored = _read(path, _Pictures)
    return np.array(stored.image_mean, np.float32), np.array(stored.image_std, np.float32)


def _opened(folder: Path) -> tuple[Any, Any]:
    """The model in float32, ready for use, and its tokenizer."""
    try:
        import torch  # noqa: F401 (transformers names its models without it, and cannot open them)
        from transformers import CLIPModel, CLIPTokenizerFast
        from transformers.utils import logging
    except ImportError:
        cure = "pip install 'brushgs[text]'"
        raise SceneError(folder, f"is a CLIP model, which torch and transformers read; {cure}") from None
    logging.set_verbosity_error()
    logging.disable_progress_bar()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tokenizer = CLIPTokenizerFast.from_pretrained(folder, local_files_only=True)
            model = pretrained(CLIPModel, folder, "CLIP", MODEL)
    except SceneError:
        raise
    except Exception as error:  # any error of the library for invalid files
        raise _not_opened(folder, "CLIP", error, MODEL) from None
    return model, tokenizer


def pretrained(kind: Any, folder: Path, name: str, cure: str, **options: Any) -> Any:
    """A model of a class of transformers in float32, ready for use, from safetensors in a folder.

    Args:
        kind: the class.
        folder: with the model.
        name: of it, for messages.
        cure: the remedy to name in messages.
        options: further ones of `from_pretrained`.

    Raises:
        SceneError: if it cannot be opened, or lacks weights.
    """
    import torch

    try:
        model, info = kind.from_pretrained(
            folder,
            local_files_only=True,
            use_safetensors=True,
            output_loading_info=True,
            dtype=torch.float32,
            **options,
        )
    except Exception as error:  # any error of the library for invalid files
        raise _not_opened(folder, name, error, cure) from None
    if missing := sorted(info["missing_keys"]):  # they would be random numbers
        raise SceneError(folder, f"lacks {len(missing)} of the weights of {name}, first {missing[0]}; {cure}")
    return model.eval()


def _not_opened(folder: Path, name: str, error: Exception, cure: str) -> SceneError:
    sentence = " ".join(str(error).split())[:200]
    return SceneError(folder, f"cannot be opened as {name} ({type(error).__name__}: {sentence}); {cure}")


def _unit(vectors: Any) -> F64:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(lengths, 1e-12))

"""A CLIP model of 30,000 random weights, saved as real ones are: for the code path, not for answers."""

import json

SIDE, PATCH = 32, 8  # pixels
LETTERS = "abcdefghijklmnopqrstuvwxyz"


def save_tiny_clip(folder):
    """Write config, weights, tokenizer and preprocessor; returns the folder."""
    import torch
    from transformers import CLIPConfig, CLIPModel

    torch.manual_seed(0)
    folder.mkdir(parents=True, exist_ok=True)
    # The letters, in the two files that the first models came with.
    words = [*LETTERS, *(f"{letter}</w>" for letter in LETTERS), "re", "red</w>"]
    vocab = {word: row for row, word in enumerate([*words, "<|startoftext|>", "<|endoftext|>"])}
    (folder / "vocab.json").write_text(json.dumps(vocab))
    (folder / "merges.txt").write_text("#version: 0.2\nr e\nre d</w>\n")
    size = {"hidden_size": 16, "intermediate_size": 32, "num_attention_heads": 2, "num_hidden_layers": 2}
    end = vocab["<|endoftext|>"]
    ids = {"bos_token_id": vocab["<|startoftext|>"], "eos_token_id": end, "pad_token_id": end}
    config = CLIPConfig(
        text_config={**size, **ids, "vocab_size": max(len(vocab), 64), "max_position_embeddings": 12},
        vision_config={**size, "image_size": SIDE, "patch_size": PATCH},
        projection_dim=8,
    )
    CLIPModel(config).save_pretrained(folder)
    numbers = {"image_mean": [0.5, 0.5, 0.5], "image_std": [0.25, 0.25, 0.25]}
    (folder / "preprocessor_config.json").write_text(json.dumps(numbers))
    return folder

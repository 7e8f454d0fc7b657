"""A GGUF file of a hundred kilobytes, written here: a llama of one layer whose weights say which letter follows which."""

from pathlib import Path

import numpy as np

WIDTH = 32
LETTERS = "abcdefghijklmnopqrstuvwxyz."
BYTES = tuple(f"<0x{each:02X}>" for each in range(256))
TOKENS = ("<unk>", "<s>", "</s>", *BYTES, "\N{LOWER ONE EIGHTH BLOCK}", *LETTERS)
END_OF_LINE = TOKENS.index("<0x0A>")


def make(file: Path, follows: dict[str, str]) -> None:
    """Write a model that, after each letter of `follows`, goes on with its value; after any other letter the line ends.

    Attention and feed-forward are zero: what follows a letter is read from its embedding alone.
    """
    import gguf

    count, letters = len(TOKENS), {letter: at for at, letter in enumerate(TOKENS) if letter in LETTERS}
    embedding, output = np.zeros((count, WIDTH), np.float32), np.zeros((count, WIDTH), np.float32)
    for column, (letter, at) in enumerate(letters.items()):
        embedding[at, column] = 1.0
        output[letters[follows[letter]] if letter in follows else END_OF_LINE, column] = 4.0
    writer = gguf.GGUFWriter(str(file), "llama")
    writer.add_name("tiny")
    writer.add_context_length(4096)
    writer.add_embedding_length(WIDTH)
    writer.add_block_count(1)
    writer.add_feed_forward_length(WIDTH)
    writer.add_head_count(1)
    writer.add_head_count_kv(1)
    writer.add_layer_norm_rms_eps(1e-5)
    writer.add_rope_dimension_count(WIDTH)
    writer.add_vocab_size(count)
    writer.add_tokenizer_model("llama")
    writer.add_token_list([each.encode() for each in TOKENS])
    writer.add_token_scores([0.0] * count)
    writer.add_token_types([2, 3, 3, *[6] * len(BYTES), *[1] * (len(LETTERS) + 1)])
    writer.add_bos_token_id(1)
    writer.add_eos_token_id(2)
    writer.add_unk_token_id(0)
    writer.add_add_space_prefix(False)
    ones, square = np.ones(WIDTH, np.float32), np.zeros((WIDTH, WIDTH), np.float32)
    writer.add_tensor("token_embd.weight", embedding)
    writer.add_tensor("output_norm.weight", ones)
    writer.add_tensor("output.weight", output)
    for name in ("attn_q", "attn_k", "attn_v", "attn_output", "ffn_gate", "ffn_up", "ffn_down"):
        writer.add_tensor(f"blk.0.{name}.weight", square)
    for name in ("attn_norm", "ffn_norm"):
        writer.add_tensor(f"blk.0.{name}.weight", ones)
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_tensors_to_file()
    writer.close()

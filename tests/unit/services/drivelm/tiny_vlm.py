"""A vision-language checkpoint of a few thousand weights, made here: random, then taught two pictures in two seconds."""

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from services.drivelm.backends.prompts import load
from services.drivelm.reading.crops import Picture
from services.drivelm.vocabulary.classes import QUESTIONS, SENTENCES

torch: Any = importlib.import_module("torch")
transformers: Any = importlib.import_module("transformers")
tokenizers: Any = importlib.import_module("tokenizers")
_LLAVA = "transformers.models.llava.image_processing_pil_llava"
_SPECIAL = ("<pad>", "<s>", "</s>", "<unk>", "<image>")
_SIDE_PX, _PATCH_PX = 16, 8
_TEMPLATE = (
    "{% for m in messages %}{{ m['role'] }} {% for c in m['content'] %}"
    "{% if c['type'] == 'image' %}<image> {% else %}{{ c['text'] }} {% endif %}{% endfor %}{% endfor %}"
    "{% if add_generation_prompt %}assistant {% endif %}"
)
RED = np.full((30, 40, 3), (220, 10, 10), np.uint8)
BLUE = np.full((30, 40, 3), (10, 10, 220), np.uint8)


def make(folder: Path, *, taught: bool, seed: int = 0) -> None:
    """Save a checkpoint that answers the sign question with `stop` for red and `roundabout` for blue, if taught."""
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    processor, model = _processor(), _model()
    if taught:
        _teach(processor, model, ((RED, SENTENCES["stop"]), (BLUE, SENTENCES["roundabout"])))
    model.save_pretrained(folder)
    processor.save_pretrained(folder)


def _words() -> list[str]:
    text = " ".join((*load().texts.values(), *SENTENCES.values(), "user assistant"))
    return sorted({word for word, _ in tokenizers.pre_tokenizers.WhitespaceSplit().pre_tokenize_str(text)})


def _processor() -> Any:
    vocabulary = {word: number for number, word in enumerate((*_SPECIAL, *_words()))}
    inner = tokenizers.Tokenizer(tokenizers.models.WordLevel(vocabulary, unk_token="<unk>"))
    inner.pre_tokenizer = tokenizers.pre_tokenizers.WhitespaceSplit()
    tokenizer = transformers.PreTrainedTokenizerFast(
        tokenizer_object=inner, pad_token="<pad>", bos_token="<s>", eos_token="</s>", unk_token="<unk>",
        additional_special_tokens=["<image>"],
    )  # fmt: skip
    size = {"height": _SIDE_PX, "width": _SIDE_PX}
    return transformers.LlavaProcessor(
        image_processor=importlib.import_module(_LLAVA).LlavaImageProcessorPil(size=size, crop_size=size, do_center_crop=False),
        tokenizer=tokenizer, patch_size=_PATCH_PX, vision_feature_select_strategy="default",
        num_additional_image_tokens=1, chat_template=_TEMPLATE,
    )  # fmt: skip


def _model() -> Any:
    small = {"hidden_size": 32, "intermediate_size": 32, "num_hidden_layers": 1, "num_attention_heads": 2}
    vision = transformers.CLIPVisionConfig(image_size=_SIDE_PX, patch_size=_PATCH_PX, **small)
    text = transformers.LlamaConfig(
        num_key_value_heads=2, vocab_size=len(_SPECIAL) + len(_words()), max_position_embeddings=2048,
        bos_token_id=1, eos_token_id=2, pad_token_id=0, **small,
    )  # fmt: skip
    return transformers.LlavaForConditionalGeneration(
        transformers.LlavaConfig(
            vision_config=vision, text_config=text, image_token_index=4, vision_feature_select_strategy="default",
            vision_feature_layer=-1,
        )
    )  # fmt: skip


def _teach(processor: Any, model: Any, lessons: tuple[tuple[Picture, str], ...]) -> None:
    rows = [_lesson(processor, picture, sentence) for picture, sentence in lessons]
    optimiser = torch.optim.Adam(model.parameters(), lr=1e-2)
    model.train()
    for _ in range(120):
        loss = torch.stack([model(**inputs).loss for inputs in rows]).sum()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        if loss.item() < 0.01:
            break
    model.eval()


def _lesson(processor: Any, picture: Picture, sentence: str) -> dict[str, Any]:
    content = [{"type": "image", "image": picture}, {"type": "text", "text": load().texts[QUESTIONS["sign"]]}]
    inputs = processor.apply_chat_template(
        [{"role": "user", "content": content}], add_generation_prompt=True, tokenize=True, return_dict=True,
        return_tensors="pt",
    )  # fmt: skip
    answer = processor.tokenizer(f"{sentence} </s>", add_special_tokens=False, return_tensors="pt").input_ids
    asked = inputs["input_ids"]
    both = torch.cat([asked, answer], dim=1)
    labels = torch.cat([torch.full_like(asked, -100), answer], dim=1)
    return {
        "input_ids": both, "attention_mask": torch.ones_like(both), "labels": labels,
        "pixel_values": inputs["pixel_values"],
    }  # fmt: skip

"""In which precision a network is trained on this processor."""

import torch


def has_bfloat16() -> bool:
    """Whether the processor multiplies bfloat16 itself; one that does not takes twelve times as long for it as for float32."""
    able = torch.cpu.get_capabilities()
    return bool(able.get("avx512_bf16") or able.get("amx_bf16") or able.get("arm_bf16"))

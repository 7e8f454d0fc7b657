"""ONNX Runtime sessions on the execution providers that a configuration names."""

from pathlib import Path
from typing import Any

from drivemcp.errors import ConfigError

PROVIDERS: dict[str, tuple[str, str]] = {
    "cpu": ("CPUExecutionProvider", "onnxruntime"),
    "cuda": ("CUDAExecutionProvider", "onnxruntime-gpu"),
    "tensorrt": ("TensorrtExecutionProvider", "onnxruntime-gpu"),
    "openvino": ("OpenVINOExecutionProvider", "onnxruntime-openvino"),
    "coreml": ("CoreMLExecutionProvider", "onnxruntime on macOS"),
}
"""Name in a configuration -> ONNX Runtime's name, and the package that brings it."""
CPU = ("cpu",)


def chosen(providers: str, field: str) -> tuple[str, ...]:
    """The names in a comma-separated setting. Raises ConfigError naming the field where one is unknown or the installed ONNX Runtime
    lacks it."""
    import onnxruntime

    there = onnxruntime.get_available_providers()
    names = tuple(name.strip() for name in providers.split(","))
    for name in names:
        if name not in PROVIDERS:
            raise ConfigError(
                f"{field} = {name or 'nothing'}: no execution provider of that name; there are {', '.join(PROVIDERS)}"
            )
        theirs, package = PROVIDERS[name]
        if theirs not in there:
            here = ", ".join(each for each, (known, _) in PROVIDERS.items() if known in there)
            raise ConfigError(f"{field} = {name}: this ONNX Runtime has {here} only; install {package} instead of it")
    return names


def broken() -> tuple[type[Exception], ...]:
    """What ONNX Runtime raises for a file that is no model, or one that it cannot run."""
    from onnxruntime.capi import onnxruntime_pybind11_state as state

    return tuple(each for each in vars(state).values() if isinstance(each, type) and issubclass(each, Exception))


def open_session(path: Path, threads: int, providers: tuple[str, ...] = CPU, *, spinning: bool = True) -> Any:
    """A session on the named providers in their order; what none of them computes falls to the CPU.

    Raises ONNX Runtime's own errors for a file that is no model, ConfigError where a named provider does not start: ONNX Runtime
    would go on without it.
    """
    import onnxruntime

    settings = onnxruntime.SessionOptions()
    settings.intra_op_num_threads = threads
    settings.inter_op_num_threads = 1
    if not spinning:
        settings.add_session_config_entry("session.intra_op.allow_spinning", "0")
    settings.log_severity_level = 3
    wanted = [PROVIDERS[name][0] for name in dict.fromkeys((*providers, *CPU))]
    session = onnxruntime.InferenceSession(str(path), settings, providers=wanted)
    missing = [name for name in providers if PROVIDERS[name][0] not in session.get_providers()]
    if missing:
        raise ConfigError(
            f"the execution provider {missing[0]} does not start here: are its driver and libraries installed?"
        )
    return session

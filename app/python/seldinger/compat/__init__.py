"""Other simulators' interfaces over ours: compat.eve runs stEVE, which it needs; compat.cathsim is CathSim's environment."""


from typing import Any


def __getattr__(name: str) -> Any:
    if name in ("eve", "cathsim"):
        import importlib
        return importlib.import_module("." + name, __name__)
    raise AttributeError(f"module 'seldinger.compat' has no attribute '{name}'")

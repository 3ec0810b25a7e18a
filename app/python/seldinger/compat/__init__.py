"""Interfaces with the names of other simulators, over ours: compat.eve (stEVE), compat.cathsim (CathSim)."""


def __getattr__(name):
    if name in ("eve", "cathsim"):
        import importlib
        return importlib.import_module("." + name, __name__)
    raise AttributeError(f"module 'seldinger.compat' has no attribute '{name}'")

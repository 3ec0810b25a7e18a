"""Seldinger: a guidewire in vessels under X-ray, for programs that act.

    import seldinger as sd
    sim = sd.Simulation("renal")                 # that ships, a file, or a dict with a scenario's keys
    state = sim.step(advance_mm=2, rotate_deg=10)
    image = sim.image(pixels=256)                # (256, 256) uint8, made only when asked for
    snapshot = sim.snapshot(); sim.restore(snapshot)

Many at once: VectorSimulation. Environments: seldinger.gym. Other simulators' interfaces:
seldinger.compat. Lengths are in mm, forces in N, angles as named.
"""

from typing import TYPE_CHECKING, Any

from ._core import InputError, Snapshot, State, __version__, write_png
from .planning import Plan, plan
from .simulation import Simulation, VectorSimulation, assets, default_cache, scenarios, views

__all__ = ["InputError", "Plan", "Simulation", "Snapshot", "State", "VectorSimulation", "__version__", "assets", "compat",
           "default_cache", "gym", "plan", "scenarios", "views", "write_png"]


if TYPE_CHECKING:
    from . import compat, gym


def __getattr__(name: str) -> Any:
    if name in ("gym", "compat"):
        import importlib
        return importlib.import_module("." + name, __name__)
    raise AttributeError(f"module 'seldinger' has no attribute '{name}'")

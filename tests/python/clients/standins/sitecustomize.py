"""Python imports this file first where its folder is in PYTHONPATH. It lets clients import what is not installed and what they
do not use in these tests: a stand-in for each module of ABSENT that cannot be imported, whose names are all classes that take
anything. Nothing of what is tested may be one of them: no physics, no environment, no wrapper, no learner."""

import abc
import importlib.abc
import importlib.machinery
import importlib.util
import sys
import types

ABSENT = ("pyvista", "dm_control", "dm_env", "trimesh", "pympler", "memory_profiler", "mujoco", "tensorboard",
          "x_transformers", "einops")


class _Any(abc.ABCMeta):
    def __getattr__(cls, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return _named(name)


def _named(name):
    return _Any(name, (), {"__init__": lambda self, *_, **__: None, "__call__": lambda self, given=None, *_, **__: given,
                           "__getattr__": lambda self, key: _named(key)})


class _Module(types.ModuleType):
    __path__: list = []
    __version__ = "99"

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        # Decorators give back what they are given.
        return (lambda given: given) if name in ("profile", "observable") else _named(name)


class _Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    def __init__(self, names):
        self.names = names

    def find_spec(self, name, path=None, target=None):
        missing = any(name == one or name.startswith(one + ".") for one in self.names)
        return importlib.machinery.ModuleSpec(name, self, is_package=True) if missing else None

    def create_module(self, spec):
        return _Module(spec.name)

    def exec_module(self, module):
        pass


lacking = [name for name in ABSENT if importlib.util.find_spec(name) is None]
if "tensorboard" in lacking:
    lacking.append("torch.utils.tensorboard")
sys.meta_path.insert(0, _Finder(lacking))

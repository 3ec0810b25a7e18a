"""Box and Dict of gymnasium where it can be imported, else light ones with the same names and meaning."""

from __future__ import annotations

import importlib
from collections import OrderedDict
from typing import Any, ItemsView, KeysView, Mapping, Optional

import numpy as np

from .._arrays import NDArray

__all__ = ["Box", "Dict", "Space", "batched", "gymnasium"]

try:
    gymnasium: Any = importlib.import_module("gymnasium")
except ImportError:
    gymnasium = None


class Space:
    """What actions or observations may be."""

    shape: Any = None
    dtype: Any = None
    low: Any = None
    high: Any = None

    def __init__(self, seed: Optional[int] = None) -> None:
        self._random = np.random.default_rng(seed)

    def seed(self, seed: Optional[int] = None) -> None:
        self._random = np.random.default_rng(seed)

    def sample(self) -> Any:
        raise NotImplementedError

    def contains(self, x: Any) -> bool:
        raise NotImplementedError


class Box(Space):
    """Arrays between `low` and `high`, numbers or arrays."""

    def __init__(self, low: Any, high: Any, shape: Any = None, dtype: Any = np.float32,
                 seed: Optional[int] = None) -> None:
        super().__init__(seed)
        self.shape = tuple(np.broadcast(low, high).shape if shape is None else shape)
        self.dtype = np.dtype(dtype)
        self.low = np.broadcast_to(np.asarray(low, self.dtype), self.shape).copy()
        self.high = np.broadcast_to(np.asarray(high, self.dtype), self.shape).copy()

    def sample(self) -> NDArray[Any]:
        made: NDArray[Any] = self._random.integers(self.low, self.high, endpoint=True, dtype=self.dtype) \
            if self.dtype.kind in "iu" else self._random.uniform(self.low, self.high).astype(self.dtype)
        return made

    def contains(self, x: Any) -> bool:
        return (isinstance(x, np.ndarray) and x.shape == self.shape and np.can_cast(x.dtype, self.dtype)
                and bool(np.all(x >= self.low) and np.all(x <= self.high)))

    __contains__ = contains

    def __repr__(self) -> str:
        return f"Box({self.low.min()}, {self.high.max()}, {self.shape}, {self.dtype})"

    def __eq__(self, other: Any) -> bool:
        return (isinstance(other, Box) and self.shape == other.shape and self.dtype == other.dtype
                and np.array_equal(self.low, other.low) and np.array_equal(self.high, other.high))


class Dict(Space):
    """A space for each key."""

    def __init__(self, spaces: Mapping[str, Space], seed: Optional[int] = None) -> None:
        super().__init__(seed)
        self.spaces = OrderedDict(spaces)

    def seed(self, seed: Optional[int] = None) -> None:
        for k, space in enumerate(self.spaces.values()):
            space.seed(None if seed is None else seed + k)

    def sample(self) -> dict[str, Any]:
        return {key: space.sample() for key, space in self.spaces.items()}

    def contains(self, x: Any) -> bool:
        return (isinstance(x, dict) and x.keys() == self.spaces.keys()
                and all(space.contains(x[key]) for key, space in self.spaces.items()))

    __contains__ = contains

    def __getitem__(self, key: str) -> Space:
        return self.spaces[key]

    def keys(self) -> KeysView[str]:
        return self.spaces.keys()

    def items(self) -> ItemsView[str, Space]:
        return self.spaces.items()

    def __repr__(self) -> str:
        return "Dict(" + ", ".join(f"{key}: {space}" for key, space in self.spaces.items()) + ")"

    def __eq__(self, other: Any) -> bool:
        return isinstance(other, Dict) and dict(self.spaces) == dict(other.spaces)


if gymnasium:
    globals().update({name: getattr(gymnasium.spaces, name) for name in ("Box", "Dict", "Space")})


def batched(space: Space, n: int) -> Space:
    """The space of n of these, one above the other."""
    if isinstance(space, Dict):
        return Dict({key: batched(one, n) for key, one in space.spaces.items()})
    return Box(np.repeat(space.low[None], n, 0), np.repeat(space.high[None], n, 0), dtype=space.dtype)

"""What a reset draws: ranges by key of the scenario, and what no scenario knows."""

from __future__ import annotations

import math
import operator
import os
from numbers import Real
from typing import Any, Callable, Iterator, Mapping, Optional, Sequence, Tuple

import numpy as np

from .._core import InputError
from ..simulation import facts

OWN = ("scenario", "target", "latency_steps", "tracking_noise_mm")
STAND = ("c_arm.lao_deg", "c_arm.cranial_deg")  # which a command turns, so that all else stays as it is
EXPECTED = "a scenario's keys, such as 'guidewire.friction', " + ", ".join(f"'{key}'" for key in OWN)
COMMON = {"devices": "devices", "device_names": "devices of the same names", "frame_rate_hz": "frames a second",
          "pixels": "pixels of the C-arm"}


def is_number(value: Any) -> bool:
    try:
        return isinstance(value, (Real, np.number)) and not isinstance(value, (bool, np.bool_)) and math.isfinite(value)
    except OverflowError:  # a whole number beyond all floats
        return False


def whole(value: Any) -> Optional[int]:
    """A whole number of Python or NumPy, arrays without dimension among them; None for what is none."""
    try:
        return operator.index(value)
    except TypeError:
        return None


def is_list(value: Any) -> bool:
    return isinstance(value, (list, tuple, np.ndarray))


def _ends(value: Any) -> Optional[Tuple[Any, Any]]:
    """Ends of a range: two numbers, or two lists of as many numbers."""
    if not is_list(value) or len(value) != 2:
        return None
    if all(is_number(end) for end in value):
        return value[0], value[1]
    if all(is_list(end) and len(end) > 0 and all(is_number(x) for x in end) for end in value) \
            and len(value[0]) == len(value[1]):
        return np.minimum(*value), np.maximum(*value)  # in any order: (0, 1, -4) and (0, 2, -10)
    return None


def _is_whole(key: str) -> bool:
    return key.endswith("seed") or key == "latency_steps"


def _in(key: str, ends: Tuple[Any, Any], part: Callable[[Any, Any], Any]) -> Any:
    """A value of a range; `part` takes one of [low, high] or, of whole numbers, of low to high - 1."""
    if _is_whole(key):
        return int(part(int(ends[0]), int(ends[1])))
    value = part(*ends)
    return value.tolist() if isinstance(value, np.ndarray) else float(value)


def _filled(value: Any, rng: np.random.Generator) -> Any:
    """With what dicts in it leave open."""
    if isinstance(value, Mapping):
        return {key: drawn(key, inner, rng) for key, inner in value.items()}
    return [_filled(inner, rng) for inner in value] if isinstance(value, (list, tuple)) else value


def drawn(key: str, value: Any, rng: np.random.Generator) -> Any:
    """A value that follows from a range, a list of choices, a callable or, itself, from anything else."""
    if callable(value):
        return value(rng)
    ends = _ends(value)
    if ends is not None:
        part: Any = rng.integers if _is_whole(key) else rng.uniform
        return _in(key, ends, part)
    return _filled(value[int(rng.integers(len(value)))] if is_list(value) else value, rng)


def _samples(key: str, value: Any) -> Iterator[Any]:
    """Values by which a range is judged: its ends, all choices."""
    rng = np.random.default_rng(0)
    ends = _ends(value)
    if ends is not None:
        yield _in(key, ends, lambda low, high: low)
        yield _in(key, ends, lambda low, high: high - 1 if _is_whole(key) else high)
    elif is_list(value):
        for choice in value:
            yield _filled(choice, rng)
    else:
        yield drawn(key, value, rng)


def named(scenario: Any) -> str:
    return "the dict" if isinstance(scenario, Mapping) else f"'{os.fspath(scenario)}'"


def checked_values(what: str, scenario: Any, set: Mapping[str, Any], values: Mapping[str, Any]) -> None:
    """Raises InputError for values that the scenario, with `set` in place of its own, cannot have, and for those that would
    change what an environment's spaces and steps are made of."""
    try:
        other = facts(scenario, {**set, **values})
    except InputError as error:
        raise InputError(f"{what}: {error}; expected {EXPECTED}") from None
    first = facts(scenario, set)
    for key, kind in COMMON.items():
        if other[key] != first[key]:
            raise InputError(f"{what}: expected values that leave {kind} as they are; {first[key]} would become {other[key]}")


class Draws:
    """Ranges that were checked. Raises InputError for those that this scenario could not have, with `set` in place of its
    values."""

    def __init__(self, ranges: Any, scenario: Any, set: Mapping[str, Any]) -> None:
        if not isinstance(ranges, Mapping) or not all(isinstance(key, str) for key in ranges):
            raise InputError(f"randomize: {ranges!r} was given; expected a dict of {EXPECTED}, or a callable that returns one")
        self.ranges = dict(ranges)
        scenarios = self._checked_scenarios()
        self._check_target()
        first = facts(scenario, set) if scenarios else {}
        for choice in scenarios:
            other = facts(choice, set)
            for key, what in COMMON.items():
                if other[key] != first[key]:
                    raise InputError(f"randomize: expected scenarios with equally many {what}; {named(choice)} has "
                                     f"{other[key]}, {named(scenario)} has {first[key]}")
        for key, value in self.ranges.items():
            if key in ("scenario", "target"):
                continue
            self._check_range(key, value)
            for sample in _samples(key, value):
                if key in OWN:
                    if not is_number(sample) or sample < 0 or (whole(sample) is None and _is_whole(key)):
                        self._refuse(key, "a range of whole numbers of 0 or more" if _is_whole(key)
                                     else "a range of numbers of 0 or more")
                    continue
                for one in scenarios or (scenario,):
                    checked_values("randomize", one, set, {key: sample})

    def _refuse(self, key: str, accepted: str) -> None:
        raise InputError(f"randomize: {key} {self.ranges[key]!r} was given; expected {accepted}")

    def _check_range(self, key: str, value: Any) -> None:
        if is_list(value) and len(value) == 0:
            self._refuse(key, "a range (low, high), a list of choices or a callable")
        ends = _ends(value)
        if _is_whole(key) and is_list(value) and not (ends and all(whole(end) is not None for end in ends)
                                                      and 0 <= ends[0] < ends[1]):
            self._refuse(key, "(first, end), two whole numbers of 0 or more,")
        if ends is not None and is_number(ends[0]) and ends[0] > ends[1]:
            self._refuse(key, "(low, high), low first")

    def _checked_scenarios(self) -> Sequence[Any]:
        choices = self.ranges.get("scenario", ())
        if isinstance(choices, (str, os.PathLike, Mapping)):
            choices = self.ranges["scenario"] = (choices,)
        if not isinstance(choices, (list, tuple)) or ("scenario" in self.ranges and len(choices) == 0):
            self._refuse("scenario", "a scenario or a list of them")
        return list(choices)

    def _check_target(self) -> None:
        target = self.ranges.get("target", "scenario")
        if isinstance(target, str):
            known = target in ("scenario", "branches", "targets")
        else:
            known = (isinstance(target, (list, tuple)) and len(target) > 0
                     and all(isinstance(branch, str) for branch in target))
        if not known:
            self._refuse("target", "'branches', 'targets' or a list of branches")

    @property
    def target(self) -> Any:
        return self.ranges.get("target", "scenario")

    @property
    def change_the_scenario(self) -> bool:
        return any(key not in (*OWN, *STAND) for key in self.ranges)

    def scenario(self, own: Any, rng: np.random.Generator) -> Any:
        choices = self.ranges.get("scenario", ())
        return choices[int(rng.integers(len(choices)))] if choices else own

    def values(self, rng: np.random.Generator, stand: bool) -> dict[str, Any]:
        """Values of the scenario's keys: of those that commands of the stand can set, or of the others."""
        return {key: drawn(key, value, rng) for key, value in self.ranges.items()
                if key not in OWN and (key in STAND) == stand}

    def own(self, key: str, rng: np.random.Generator) -> Any:
        """Of latency_steps or tracking_noise_mm; 0 where it is not drawn."""
        return drawn(key, self.ranges[key], rng) if key in self.ranges else 0

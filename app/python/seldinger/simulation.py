"""Simulations: one, and many at once."""

from __future__ import annotations

import copyreg
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from ._arrays import NDArray
from . import _core
from ._core import InputError, Snapshot, State

if TYPE_CHECKING:
    from typing_extensions import Self

Scenario = Union[str, "os.PathLike[str]", Mapping[str, Any]]

_IMAGES = {False: "none", None: "none", True: "all", "none": "none", "dose": "dose", "all": "all"}
_MOST_THREADS = 256


def assets() -> Path:
    """The folder of the scenarios, scripts and devices that ship: SELDINGER_ASSETS, else `assets` in the package, else
    `share/seldinger` of the prefix that the package is installed in. Raises InputError where there is none."""
    named = os.environ.get("SELDINGER_ASSETS")
    package = Path(__file__).resolve().parent
    folders = [Path(named)] if named else [package / "assets"] + [p / "share" / "seldinger" for p in package.parents]
    for folder in folders:
        if (folder / "scenarios").is_dir():
            return folder
    raise InputError(f"{folders[0]}: no folder of assets was found; expected one with scenarios/ and devices/")


def scenarios() -> list[str]:
    """Names of the scenarios that ship, in alphabetical order."""
    return sorted(path.stem for path in (assets() / "scenarios").glob("*.toml") if path.name != "benchmark.toml")


def default_cache() -> Path:
    """The user's own cache of grown vessels and distance fields, which `seldinger play` and `bake` use as well."""
    cache = os.environ.get("XDG_CACHE_HOME")
    return (Path(cache) if cache else Path.home() / ".cache") / "seldinger"


def _quoted(text: str, where: str) -> str:
    """A text as TOML writes it. JSON escapes all that TOML asks for but U+007F; its escapes of characters beyond U+FFFF,
    which are pairs, are none of TOML."""
    try:
        text.encode()
    except UnicodeEncodeError:
        raise InputError(f"{where}: {ascii(text)} was found, which is no Unicode; expected a text without surrogates") \
            from None
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _toml(value: Any, where: str) -> str:
    """A value as TOML writes it."""
    if isinstance(value, np.ndarray):
        value = value.tolist()  # a number, where it has no dimension
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, (str, os.PathLike)):
        return _quoted(str(value), where)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(item, where) for item in value) + "]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_quoted(str(k), where)} = {_toml(v, where)}" for k, v in value.items()) + "}"
    raise InputError(f"{where}: {type(value).__name__} was found; expected a truth value, number, text, list or dict")


def _located(scenario: Scenario) -> tuple[str, Optional[str]]:
    """File and text of a scenario; no text for one that is read from its file."""
    if isinstance(scenario, Mapping):
        text = "".join(f"{_quoted(str(key), 'scenario')} = {_toml(value, str(key))}\n" for key, value in scenario.items()
                       if key != "schema")
        return str(Path.cwd() / "custom.toml"), f"schema = {_toml(scenario.get('schema', 1), 'schema')}\n{text}"
    if not isinstance(scenario, (str, os.PathLike)):
        raise InputError(f"scenario: {type(scenario).__name__} was given; expected a name, a file or a dict")
    name = os.fspath(scenario)
    if name.endswith(".toml") or os.sep in name:
        return name, None
    shipped = assets() / "scenarios" / (name + ".toml")
    if not shipped.is_file():
        raise InputError(f"'{name}': no such scenario; expected a file (.toml), a dict, or one that ships: "
                         + ", ".join(scenarios()))
    return str(shipped), None


def _overrides(values: Optional[Mapping[str, Any]]) -> list[tuple[str, str]]:
    if values is not None and not isinstance(values, Mapping):
        raise InputError(f"set: {type(values).__name__} was given; expected a dict of keys and values")
    for key in values or {}:
        if not isinstance(key, str):
            raise InputError(f"set: the key {key!r} was found; expected a text such as 'guidewire.friction'")
    return [(key, _toml(value, key)) for key, value in (values or {}).items()]


def facts(scenario: Scenario, set: Optional[Mapping[str, Any]] = None) -> dict[str, Any]:
    """devices, device_names, frame_rate_hz and pixels of a scenario, of which no vessels are grown."""
    file, text = _located(scenario)
    return _core._facts(file, text, str(assets() / "devices"), _overrides(set))


def _folder(cache: Union[str, "os.PathLike[str]", None]) -> str:
    if not isinstance(cache, (str, bytes, os.PathLike, type(None))):
        raise InputError(f"cache: {cache!r} was given; expected a folder, '' or None")
    return str(default_cache()) if cache is None else os.fspath(cache)


def views(scenario: Scenario, *, branch: Optional[str] = None, from_mm: Optional[float] = None,
          to_mm: Optional[float] = None, side: Optional[str] = None, contrast: Optional[str] = None,
          step_deg: float = 5.0, apart_deg: float = 20.0, set: Optional[Mapping[str, Any]] = None,
          cache: Union[str, "os.PathLike[str]", None] = None) -> dict[str, Any]:
    """How well the C-arm shows a stretch of the vessels from every angle, as `seldinger views`; docs/plan.md.

    scenario   a name, a file or a dict, as of Simulation
    branch     vessel to show, with from_mm and to_mm from its origin; by default the last part of the way to the target
    side       branch whose first 10 mm have to be seen too: a bifurcation
    contrast   branch at whose origin contrast comes in; by default the flush catheter's, else all vessels are filled
    step_deg   between angles, 1 to 30; apart_deg: between the best views at least, 1 to 90
    set        values of scenario keys, as of Simulation

    Returns a dict: target, a text; lao_deg (n,) and cranial_deg (m,), RAO and caudal negative; foreshortening, overlap,
    ostium_deg and cost (m, n) float64; free (m, n) bool, whether the stand takes the angle; best_deg (k, 2) float64, LAO and
    cranial of the best views, three or fewer. Raises InputError for a branch or stretch that does not exist."""
    file, text = _located(scenario)
    for name, given in (("branch", branch), ("side", side), ("contrast", contrast)):
        if not isinstance(given, (str, type(None))):
            raise InputError(f"{name}: {given!r} was given; expected the name of a branch or None")
    return _core._views(file, text, str(assets() / "devices"), _overrides(set), _folder(cache), branch, from_mm, to_mm,
                        side or "", contrast or "", step_deg, apart_deg)


class _Closes:
    """A context manager that closes itself."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        raise NotImplementedError


# States and snapshots may be pickled and copied: by the version that made them, on a machine of its kind.
def _state(*parts: Any) -> State:
    return _core._state(parts)


def _snapshot(*parts: Any) -> Snapshot:
    return _core._snapshot(parts)


copyreg.pickle(State, lambda state: (_state, _core._parts(state)))
copyreg.pickle(Snapshot, lambda snapshot: (_snapshot, _core._parts(snapshot)))

Place = Tuple[Optional[str], Optional[NDArray[np.float64]], float]


Made = Tuple[str, Optional[str], str, Sequence[Tuple[str, str]], str, str, bool]


def _aim(target: Place) -> dict[str, Any]:
    name, place, radius = target
    return {"target": place if name is None else name, "radius_mm": radius}


def same_target(a: Place, b: Place) -> bool:
    return a[0] == b[0] and np.array_equal(a[1], b[1]) and a[2] == b[2]  # type: ignore[arg-type]


class Simulation(_core.Simulation, _Closes):
    """One exercise: a wire, alone or in a catheter, in vessels.

    scenario   the name of one that ships (see scenarios()), a file (.toml), or a dict with a scenario's keys
    set        values in place of the scenario's: {"guidewire.friction": 0.1, "anatomy.seed": 7}
    images     False: no pulses are imaged, image() makes images on demand. "dose": beam counts as dose in the score,
               the same as with images. True: the room's screen, too (image(mode="screen")), at the cost of each pulse
    panel      whether panel() draws the room's panel: its readouts then follow every frame
    cache      folder that keeps grown vessels and distance fields; by default the user's own, "" for none

    The first simulation of an anatomy grows its vessels, which takes seconds to a minute; Ctrl-C ends that. Later ones
    read them from the cache. A simulation may be used by several threads: calls wait for each other. It is a context
    manager that closes itself. copy.deepcopy gives another in the same state, which shares the vessels, and pickle one in
    another process, which grows or reads them again.

    Raises InputError, with file:line:column where there is a file, for a scenario that is not accepted.
    """

    def __init__(self, scenario: Scenario, *, set: Optional[Mapping[str, Any]] = None,
                 images: Union[bool, str] = False, panel: bool = False,
                 cache: Union[str, "os.PathLike[str]", None] = None) -> None:
        self._made = self._arguments(scenario, set=set, images=images, panel=panel, cache=cache)
        self._open(*self._made)

    @staticmethod
    def _arguments(scenario: Scenario, *, set: Optional[Mapping[str, Any]], images: Union[bool, str], panel: bool,
                  cache: Union[str, "os.PathLike[str]", None]) -> Made:
        """What the core's simulation is opened with."""
        file, text = _located(scenario)
        if not isinstance(images, (bool, np.bool_, str, int, type(None))) or images not in _IMAGES:
            raise InputError(f"images: {images!r} was given; expected False, 'dose' or True")
        overrides = _overrides(set)
        return file, text, str(assets() / "devices"), overrides, _IMAGES[images], _folder(cache), bool(panel)

    def __reduce__(self) -> Tuple[Any, ...]:
        return _opened, (type(self), self.__dict__, self._target(), self.snapshot())

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        if self._made[4] == "all":  # its screens are its own
            opened: Self = _opened(type(self), self.__dict__, self._target(), self.snapshot())
            return opened
        copied = type(self).__new__(type(self))
        copied.__dict__.update(self.__dict__)
        copied._open_like(self)
        copied.restore(self.snapshot())
        return copied

    def __copy__(self) -> Self:
        return self.__deepcopy__({})

    def __repr__(self) -> str:
        name = Path(self._made[0]).stem if "_made" in self.__dict__ else "not made"
        if name == "not made" or self.closed:
            return f"<Simulation {name}{'' if name == 'not made' else ', closed'}>"
        return f"<Simulation {name}: {repr(self.state)[1:-1]}>"

    def _repr_png_(self) -> bytes:
        """The image, for notebooks."""
        return _core._png(self.image())

    def score(self) -> dict[str, Any]:
        """The attempt's score as in score.json (keys carry units); `earlier_attempts` holds those that a reset command
        ended."""
        score: dict[str, Any] = json.loads(self._score())
        return score


def _opened(of: Any, attributes: Mapping[str, Any], target: Optional[Place] = None,
            snapshot: Optional[Snapshot] = None) -> Any:
    """A Simulation from what a pickle keeps of it."""
    made = of.__new__(of)
    made.__dict__.update(attributes)
    made._open(*made._made)
    if target:
        if not same_target(made._target(), target):
            made.reset(**_aim(target))
        made.restore(snapshot)
    return made


class VectorSimulation(_core.VectorSimulation, _Closes):
    """Many simulations at once, on a pool of threads that share vessels and walls.

    scenario   as for Simulation, or a Simulation (not with images=True), or a list of n of these
    n          how many, 1 to 100000; with a list its length
    threads    that make frames, the caller's among them, 1 to 256; by default one for each core, 256 at most. Results do
               not depend on it
    points, spacing_mm   the points of `track_mm`: so many from the tip backward at this distance

    What a step leaves is in arrays that are attributes, made once and written by each step (copy what is to stay): one of n
    for each field of State that is no list, with its name and unit (docs/python.md has the table of them), of shape (n,),
    (n, 3) for places, (n, 2) in pixels, and (n, 2) of wire and catheter for what a hand does and feels: inserted_mm,
    turned_deg, push_N, torque_Nmm. branch is the index of the branch. They are the fields of one record array, `readings`.
    (n, points, 3) track_mm and (n, points, 2) track_px: points on the device that the exercise is about; (n, devices,
    points, 3) tracks_mm and (n, devices, points, 2) tracks_px: on each, all at the introducer for one that is out.
    (n, 2) c_arm_deg: LAO and cranial; (n, 3) table_mm: how far the table has moved, as patients lie on it.

    To be used by one thread of Python at a time; calls of others wait. Ctrl-C ends a long call between its parts.
    """

    def __init__(self, scenario: Any, n: Optional[int] = None, *, threads: Optional[int] = None, points: int = 3,
                 spacing_mm: float = 2.0, **options: Any) -> None:
        several = list(scenario) if isinstance(scenario, (list, tuple)) else None
        if several is not None:
            if not several or (n is not None and n != len(several)):
                raise InputError(f"n: {n} was given with {len(several)} scenarios; expected their number, 1 or more")
            n = len(several)
        made: dict[Any, Simulation] = {}

        def prototype(one: Any) -> Simulation:
            if isinstance(one, Simulation):
                return one
            key = one if isinstance(one, (str, os.PathLike)) else id(one)
            if key not in made:
                made[key] = Simulation(one, **options)
            return made[key]

        first = prototype(several[0] if several is not None else scenario)
        threads = min(len(os.sched_getaffinity(0)), _MOST_THREADS) if threads is None else threads
        self._made = (threads, points, spacing_mm)
        self._open(first, 1 if n is None else n, *self._made)
        self.likes: list[Simulation] = [first] * len(self)
        for i, one in enumerate(several or []):
            if i > 0 and prototype(one) is not first:
                self.assign(i, prototype(one))
        self.__dict__.update(self._arrays)

    def assign(self, i: int, like: Simulation) -> None:
        """Puts a new simulation like another one, at its start, in place of the i-th; they share vessels and wall."""
        self._assign(i, like)
        self.likes[i] = like

    def _states(self) -> list[Tuple[Place, Snapshot]]:
        return [(self._target(i), self.snapshot(i)) for i in range(len(self))]

    def __reduce__(self) -> Tuple[Any, ...]:
        distinct = {id(like): (type(like), like.__dict__) for like in self.likes}
        places = {key: k for k, key in enumerate(distinct)}
        return _made_anew, (type(self), self._made, list(distinct.values()), [places[id(like)] for like in self.likes],
                            self._states())

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        copied: Self = _opened_many(type(self), self._made, self.likes, self._states())
        return copied

    def __copy__(self) -> Self:
        return self.__deepcopy__({})

    def __repr__(self) -> str:
        if "_made" not in self.__dict__:
            return "<VectorSimulation not made>"
        closed = ", closed" if self.closed else ""
        return f"<VectorSimulation of {len(self)} on {self.threads} thread{'s' * (self.threads > 1)}{closed}>"

    @property
    def turned_rad(self) -> NDArray[np.float64]:
        """turned_deg in rad, a new array."""
        return np.radians(self.turned_deg)

    def score(self, i: int) -> dict[str, Any]:
        """The score of the i-th simulation, as Simulation.score."""
        score: dict[str, Any] = json.loads(self._score(i))
        return score


def _opened_many(of: Any, made: Tuple[int, int, float], likes: Sequence[Simulation],
                 states: Sequence[Tuple[Place, Snapshot]]) -> Any:
    threads, points, spacing = made
    many = of(list(likes), threads=threads, points=points, spacing_mm=spacing)
    for i, (target, snapshot) in enumerate(states):
        many.aim(i, **_aim(target))
        many.restore(i, snapshot)
    return many


def _made_anew(of: Any, made: Tuple[int, int, float], distinct: Sequence[Tuple[Any, Mapping[str, Any]]],
               places: Sequence[int], states: Sequence[Tuple[Place, Snapshot]]) -> Any:
    """A VectorSimulation from what a pickle keeps of it."""
    likes = [_opened(one, attributes) for one, attributes in distinct]
    return _opened_many(of, made, [likes[k] for k in places], states)

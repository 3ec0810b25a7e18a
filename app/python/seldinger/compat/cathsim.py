"""CathSim's environment with the physics and images of Seldinger.

    import seldinger.compat.cathsim                      # registers cathsim/CathSim-v0 where gymnasium is installed
    env = gymnasium.make("cathsim/CathSim-v0", phantom="phantom3", target="bca", use_pixels=True, return_info=True)

It has CathSim's keywords, observation keys, shapes, infos and attributes. Scripts that import cathsim.gym.envs get this
environment in place of CathSim's after install(), or run as they are by

    python3 -m seldinger.compat.cathsim SCRIPT [ARGUMENT]...

The vessels are ours, not CathSim's: its phantoms are under a licence that does not let us ship them. phantom3 and low_tort
are our arch of type I, phantom2 one of type II, phantom4 one of type III; bca and lcca lie 25 mm within their arteries, as far
from the wire's start as CathSim's, 0.14 m. Results in them are not results in CathSim's.

What differs on purpose: a seed has an effect, and an action of 1 is 35 mm/s or 3.14 rad/s for 1/15 s. There is no flow
(apply_fluid_force) and no MuJoCo behind it (dm_env, physics).
"""

from __future__ import annotations

import math
import sys
from typing import Any, Mapping, Optional, Sequence, Union

import numpy as np

from .._arrays import NDArray
from .._core import InputError
from ..gym.batch import Floats, checked_seed
from ..gym.draws import is_number, whole
from ..gym.spaces import Box, Dict, gymnasium
from ..simulation import Simulation

__all__ = ["CathSim", "PHANTOMS", "TARGETS", "install", "make_dm_env"]

ID = "cathsim/CathSim-v0"
MOST_STEPS = 300
PHANTOMS = {"phantom3": "arch-1", "low_tort": "arch-1", "phantom2": "arch-2", "phantom4": "arch-3"}
TARGETS = {"bca": "brachiocephalic+RSA", "lcca": "LCCA+LICA"}

_SITE = 25.0  # of a target within its artery [mm]
_START = 130.0  # length inside at the start [mm]
_RATE = 15.0
_SPEED = np.array([35.0, 3.14])  # of an action of 1 [mm/s, rad/s]
_BODIES, _BODY = 84, 2.0  # of CathSim's wire and tip: how many, and from one to the next [mm]
_JOINTS = 2 + 2 * (_BODIES - 1)
_TOUCH = 0.001  # least force that is a contact's [N]

_Observation = dict[str, NDArray[Any]]
_Base: Any = gymnasium.Env if gymnasium else object


def make_dm_env(*_: Any, **__: Any) -> Any:
    """CathSim's has no counterpart here."""
    raise InputError("make_dm_env: there is no MuJoCo behind this environment; expected gymnasium.make('cathsim/CathSim-v0')")


class CathSim(_Base):  # type: ignore[misc]
    """CathSim's environment; see this module for what differs.

    phantom             one of PHANTOMS, or a scenario as for seldinger.Simulation
    target              'bca', 'lcca', a target of the scenario, or a place (3,) [m]
    delta               how near the tip must come [m]; dense_reward: minus the distance [m] each step, else -1;
                        success_reward, in place of it, at the target
    use_pixels, use_side, use_segment, use_phantom_segment   the keys pixels (size, size, 3), side, guidewire, phantom
                        (size, size, 1), all uint8: an X-ray image, masks of the wire from the side and as in pixels, of vessels
    image_size          pixels along a side, 32 to 2048
    sample_target       another target in each episode: one of the two sites, or, without target_from_sites, any place of
                        their arteries
    random_init_distance   most that the wire's start differs [m]
    visualize_sites, visualize_target   discs in pixels
    return_info         whether step() gives infos: head_pos, target_pos [m]; with use_force `forces`, their sum on the wall
                        [N]; with use_contact_forces `contact_forces`, {'pos': pixels, 'force': N}; with use_geom_pos `geom_pos`
    cache               as for seldinger.Simulation

    joint_pos and joint_vel are (168,) as CathSim's: feed [m] and turn [rad] of the hub, then, from the hub on, two bends [rad]
    at each of 83 joints 2 mm apart that end at the tip. Lengths and places are in m.
    """

    def __init__(self, phantom: Any = "phantom3", use_contact_forces: bool = False, use_force: bool = False,
                 use_geom_pos: bool = False, return_info: bool = False, dm_env: Any = None, *,
                 target: Union[str, Sequence[float], Floats] = "bca", delta: float = 0.004, dense_reward: bool = True,
                 success_reward: float = 10.0, use_pixels: bool = False, use_side: bool = False, use_segment: bool = False,
                 use_phantom_segment: bool = False, image_size: int = 80, apply_fluid_force: bool = False,
                 sample_target: bool = False, visualize_sites: bool = False, visualize_target: bool = False,
                 target_from_sites: bool = True, random_init_distance: float = 0.001, render_mode: Optional[str] = None,
                 cache: Any = None) -> None:
        if dm_env is not None:
            raise InputError("dm_env: an environment of MuJoCo was given; expected None, because there is no MuJoCo here")
        if apply_fluid_force:
            raise InputError("apply_fluid_force: True was given; expected False, because blood does not move the wire here")
        if render_mode not in (None, "rgb_array"):
            raise InputError(f"render_mode: {render_mode!r} was given; expected 'rgb_array' or None")
        for name, value, most in (("delta", delta, 0.1), ("random_init_distance", random_init_distance, 0.05)):
            if not is_number(value) or not 0 <= value <= most:
                raise InputError(f"{name}: {value!r} was given; expected a number from 0 to {most} [m]")
        if not is_number(success_reward):
            raise InputError(f"success_reward: {success_reward!r} was given; expected a number")
        size = whole(image_size)
        if size is None or not 32 <= size <= 2048:
            raise InputError(f"image_size: {image_size!r} was given; expected a whole number of 32 to 2048")
        if isinstance(phantom, str) and phantom in PHANTOMS:
            scenario: Any = {
                "schema": 1, "title": phantom, "frame_rate_hz": _RATE, "anatomy": {"preset": PHANTOMS[phantom]},
                "entry": {"end": "aorta.out", "inserted_mm": _START}, "wall": {"stiffness_N_per_mm": 20.0},
                "target": {"name": "LICA"}, "c_arm": {"isocentre_mm": [20.0, 20.0, 60.0], "detector_width_mm": 400.0},
                "imaging": {"patient": False, "iodine_mg_per_ml": 5.0}}
        else:
            scenario = phantom
        self.use_contact_forces, self.use_force, self.use_geom_pos = use_contact_forces, use_force, use_geom_pos
        self.return_info, self.image_size, self.delta, self.render_mode = return_info, size, float(delta), render_mode
        self.dense_reward, self.success_reward = dense_reward, float(success_reward)
        self.sample_target, self.target_from_sites = sample_target, target_from_sites
        self.visualize_sites, self.visualize_target = visualize_sites, visualize_target
        self.random_init_distance = float(random_init_distance)
        self._core = Simulation(scenario, cache=cache)
        about = self._core.about()
        if about["devices"] != 1:
            raise InputError(f"phantom: a scenario of {about['devices']} devices was given; expected a wire alone, as CathSim "
                             "has")
        self._lao, self._step_s = about["lao_deg"], 1 / about["frame_rate_hz"]
        self._branches = {branch["name"]: branch for branch in self._core.anatomy()["branches"]}
        self.sites = {name: 1e-3 * _at(self._branches[branch], _SITE) for name, branch in TARGETS.items()
                      if branch in self._branches}
        self.sites.update({one["name"]: 1e-3 * one["centre_mm"] for one in self._core.anatomy()["targets"]})
        self.metadata = {"render_modes": ["rgb_array"], "render_fps": round(1 / self._step_s)}
        self.viewer = None
        self._images = [key for key, given in (("pixels", use_pixels), ("side", use_pixels and use_side),
                                               ("guidewire", use_segment), ("phantom", use_phantom_segment)) if given]
        self.action_space = Box(-1, 1, (2,))
        self.observation_space = Dict({
            **{key: Box(0, 255, (size, size, 3 if key == "pixels" else 1), np.uint8) for key in self._images},
            "joint_pos": Box(-np.inf, np.inf, (_JOINTS,)), "joint_vel": Box(-np.inf, np.inf, (_JOINTS,))})
        self._rng = np.random.default_rng()
        self._joints: Floats
        self.set_target(target)
        self._begin()

    # What CathSim's environment can

    def reset(self, seed: Optional[int] = None, options: Optional[Mapping[str, Any]] = None) -> tuple[_Observation, dict[str, Any]]:
        """Begins an episode: (observation, {}), as CathSim's."""
        seed = checked_seed(seed)
        self._require_open()
        if gymnasium:
            super().reset(seed=seed)
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        if self.sample_target:
            name = list(TARGETS)[int(self._rng.integers(len(TARGETS)))]
            branch = self._branches.get(TARGETS[name])
            if branch is None:
                raise InputError(f"sample_target: the vessels have no '{TARGETS[name]}'; expected False")
            along = _SITE if self.target_from_sites else self._rng.uniform(0.4, 2) * _SITE
            self.set_target(1e-3 * _at(branch, along))
        self._begin()
        return self._observed(), {}

    def step(self, action: Sequence[float]) -> tuple[_Observation, float, bool, bool, dict[str, Any]]:
        """(observation, reward, terminated, False, info). Actions beyond the space are clipped."""
        self._require_open()
        try:
            given = np.asarray(action, float)
        except (TypeError, ValueError):
            given = np.empty(0)
        if given.shape != (2,) or not np.isfinite(given).all():
            raise InputError(f"action: {action!r} was given; expected two finite numbers")
        feed, turn = np.clip(given, -1, 1) * _SPEED * self._step_s
        self._before = self._joints
        self._state = self._core.step(feed, np.degrees(turn))
        self._joints = self._joint_positions()
        away = float(np.linalg.norm(self.head_pos - self.target))
        success = away < self.delta
        reward = self.success_reward if success else -away if self.dense_reward else -1.0
        return self._observed(), reward, success, False, self._get_info() if self.return_info else {}

    def render(self, mode: str = "rgb_array", image_size: Optional[int] = None) -> NDArray[np.uint8]:
        """(size, size, 3) uint8."""
        if mode != "rgb_array":
            raise NotImplementedError(f"Render mode '{mode}' is not supported.")
        return self.render_frame(image_size)

    def render_frame(self, image_size: Optional[int] = None, camera_id: int = 0) -> NDArray[np.uint8]:
        """(size, size, 3) uint8; camera_id 2 is from the side."""
        self._require_open()
        size = self.image_size if image_size is None else image_size
        if camera_id not in (0, 2):
            raise InputError(f"camera_id: {camera_id!r} was given; expected 0, from the front, or 2, from the side")
        if camera_id == 2:
            return self._from_the_side(lambda: np.repeat(self._core.image(size)[..., None], 3, -1))
        return self._pixels(size)

    def close(self) -> None:
        """Frees the simulation."""
        self._core.close()

    def print_spaces(self) -> None:
        """Prints the shapes."""
        print("Observation space:")
        for key, value in self.observation_space.spaces.items():
            print("\t", key, value.shape)
        print("Action space:\n\t", self.action_space.shape)

    @property
    def simulation(self) -> Simulation:
        """The simulation of Seldinger."""
        return self._core

    @property
    def head_pos(self) -> Floats:
        """(3,) of the tip [m]."""
        return 1e-3 * self._state.tip_mm

    @property
    def target(self) -> Floats:
        """(3,) [m]."""
        return self._target

    def set_target(self, goal: Union[str, Sequence[float], Floats]) -> None:
        """The name of a site or a place [m]."""
        if isinstance(goal, str):
            if goal not in self.sites:
                raise InputError(f"target: '{goal}' was given; expected " + ", ".join(self.sites))
            self._target = self.sites[goal].copy()
            return
        place = np.asarray(goal, float)
        if place.shape != (3,) or not np.isfinite(place).all():
            raise InputError(f"target: {goal!r} was given; expected a name or three numbers [m]")
        self._target = place.copy()

    @property
    def force(self) -> float:
        """Sum of the forces on the wall [N]."""
        return float(self._state.joint_force_N.sum())

    @property
    def contact_forces(self) -> dict[str, list[Any]]:
        """'pos': (2,) pixels of image_size, 'force' [N] of each joint that touches the wall."""
        forces = self._state.joint_force_N
        joints = self._state.wire_mm[:len(forces)]
        touching = np.flatnonzero(forces[:len(joints)] > _TOUCH)
        return {"pos": list(self._in_pixels(joints[touching])), "force": forces[touching].tolist()}

    @property
    def guidewire_geom_pos(self) -> Floats:
        """(84, 3) of points on the wire 2 mm apart that end at its tip [m]."""
        return 1e-3 * self._points()

    # Its parts

    def _require_open(self) -> None:
        if self._core.closed:
            raise InputError("the environment is closed; expected one that is open")

    def _begin(self) -> None:
        self._state = self._core.reset()
        most = 1e3 * self.random_init_distance
        self._state = self._core.step(self._rng.uniform(-most, most), 0.0)
        self._fed = self._state.inserted_mm
        self._joints = self._before = self._joint_positions()

    def _get_info(self) -> dict[str, Any]:
        info: dict[str, Any] = {"head_pos": self.head_pos.copy(), "target_pos": self.target.copy()}
        if self.use_contact_forces:
            info["contact_forces"] = self.contact_forces
        if self.use_force:
            info["forces"] = self.force
        if self.use_geom_pos:
            info["geom_pos"] = self.guidewire_geom_pos
        return info

    def _observed(self) -> _Observation:
        size = self.image_size
        made: _Observation = {}
        masks = self._core.masks(size) if {"guidewire", "phantom"} & {*self._images} else {}
        for key in self._images:
            if key == "pixels":
                made[key] = self._pixels(size)
            elif key == "side":
                made[key] = self._from_the_side(lambda: self._core.masks(size)["wire"][..., None])
            else:
                made[key] = masks["wire" if key == "guidewire" else "vessels"][..., None]
        made["joint_pos"] = self._joints.astype(np.float32)
        made["joint_vel"] = ((self._joints - self._before) / self._step_s).astype(np.float32)
        return made

    def _pixels(self, size: int) -> NDArray[np.uint8]:
        image = np.repeat(self._core.image(size)[..., None], 3, -1)
        marks = [*(self.sites[name] for name in TARGETS if name in self.sites)] if self.visualize_sites else []
        if self.visualize_target:
            marks.append(self.target)
        for place in marks:
            centre, edge = self._core.project([1e3 * place, 1e3 * place + [3, 0, 0]], size)
            rows, columns = np.ogrid[:size, :size]
            disc = (columns - centre[0]) ** 2 + (rows - centre[1]) ** 2 <= max(1.0, ((edge - centre) ** 2).sum())
            image[disc] = (255, 0, 0)
        return image

    def _from_the_side(self, make: Any) -> NDArray[np.uint8]:
        self._core.apply(f"arm lao {90 if self._lao < 45 else -45:.0f} deg")
        image: NDArray[np.uint8] = make()
        self._core.apply(f"arm lao {self._lao:.6f} deg")
        return image

    def _in_pixels(self, places: Floats) -> NDArray[np.int32]:
        if not len(places):
            return np.empty((0, 2), np.int32)
        return np.round(self._core.project(places, self.image_size)).astype(np.int32)

    def _points(self) -> Floats:
        """(84, 3) mm from the hub to the tip; outside the introducer the wire goes on straight."""
        joints = self._state.wire_mm[::-1]
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(joints, axis=0), axis=1))])
        wanted = _BODY * np.arange(_BODIES)
        points = np.stack([np.interp(wanted, way, joints[:, c]) for c in range(3)], 1)
        outside = joints[-1] - joints[-2]
        beyond = np.maximum(wanted - way[-1], 0)[:, None] * outside / np.linalg.norm(outside)
        places: Floats = (points + beyond)[::-1]
        return places

    def _joint_positions(self) -> Floats:
        points = self._points()
        points = np.vstack([2 * points[0] - points[1], points])
        ways = np.diff(points, axis=0)
        ways /= np.linalg.norm(ways, axis=1)[:, None]
        # A frame that is carried along the wire without turning about it; bends are about its two axes across.
        x, y, z = np.cross(ways[0], np.eye(3)[np.abs(ways[0]).argmin()]).tolist()
        bends = []
        directions = ways.tolist()
        for (ax, ay, az), (bx, by, bz) in zip(directions[:-1], directions[1:]):
            along = x * ax + y * ay + z * az
            x, y, z = x - along * ax, y - along * ay, z - along * az
            size = math.sqrt(x * x + y * y + z * z)
            x, y, z = x / size, y / size, z / size
            forward = ax * bx + ay * by + az * bz
            other = (ay * z - az * y) * bx + (az * x - ax * z) * by + (ax * y - ay * x) * bz
            bends += [math.atan2(-other, forward), math.atan2(x * bx + y * by + z * bz, forward)]
        state = self._state
        return np.array([1e-3 * (state.inserted_mm - self._fed), np.radians(state.turned_deg), *bends])


def _at(branch: Mapping[str, Any], along: float) -> Floats:
    """The place so far along a branch [mm]."""
    points = branch["points_mm"]
    ways = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.array([np.interp(along, ways, points[:, c]) for c in range(3)])


def install() -> None:
    """Puts this environment in the place of CathSim's: under its id, and for scripts that import cathsim.gym.envs from now
    on."""
    import importlib
    here = importlib.import_module("seldinger.compat.cathsim")
    if gymnasium:
        gymnasium.registry.pop(ID, None)
        gymnasium.register(ID, entry_point="seldinger.compat.cathsim:CathSim", max_episode_steps=MOST_STEPS)
    sys.modules["cathsim.gym.envs"] = sys.modules["cathsim.gym.envs.cathsim"] = here
    try:
        setattr(importlib.import_module("cathsim.gym"), "envs", here)
    except ImportError:
        pass  # CathSim is not installed: its scripts are not either


if gymnasium and ID not in gymnasium.registry:
    gymnasium.register(ID, entry_point="seldinger.compat.cathsim:CathSim", max_episode_steps=MOST_STEPS)

if __name__ in ("__main__", "__mp_main__"):  # the latter in processes that the script has started
    import os

    if __name__ == "__main__":
        del sys.argv[0]
        if not sys.argv:
            sys.exit("seldinger.compat.cathsim: no script was given; expected one, and its arguments")
        os.environ["SELDINGER_SCRIPT"] = os.path.abspath(sys.argv[0])
        sys.path.insert(0, os.path.dirname(os.environ["SELDINGER_SCRIPT"]))
    install()
    # In this module and not by runpy: then those processes begin here, too.
    __file__ = os.environ["SELDINGER_SCRIPT"]
    with open(__file__, "rb") as _script:
        exec(compile(_script.read(), __file__, "exec", dont_inherit=True), globals())

"""stEVE with the physics and images of Seldinger. Needs stEVE (the package `eve`), but not its SOFA.

    import eve
    from seldinger.compat.eve import ArchVariety
    intervention = ArchVariety()                       # is an eve.intervention.MonoPlaneStatic
    pathfinder = eve.pathfinder.BruteForceBFS(intervention)
    env = eve.Env(intervention, eve.observation.Tracking2D(intervention), eve.reward.PathLengthDelta(pathfinder, 0.001),
                  eve.terminal.TargetReached(intervention), eve.truncation.MaxSteps(200), pathfinder=pathfinder)

Intervention(scenario)     a scenario of Seldinger
BasicWireNav(), ArchVariety(), DualDeviceNav()   the three benchmarks of stEVE_bench, without that package
over(intervention)         any stEVE intervention whose vessels have radii, as eve_bench.ArchVariety(), on this physics
Simulation(vessel_tree)    in place of SofaBeamAdapter(), where a script builds its own MonoPlaneStatic

Env, observations, rewards, terminals, truncations, infos, pathfinders, starts, interim targets and targets are stEVE's own.
What differs on purpose: seeds determine the devices' first rotation too, normalize_action takes effect, and make_mp() does
nothing, because a step cannot hang. A copy of an intervention, or a pickled one, begins with its devices at the start.
"""

# mypy: disable-error-code="import, misc", no-warn-return-any
from __future__ import annotations

import math
import os
from typing import Any, Mapping, Optional, Sequence

import numpy as np

from .._core import InputError
from ..gym.batch import Floats
from ..simulation import Simulation as Core
from .steve_scenario import in_arch, in_branches

try:
    import eve
    from eve.intervention import MonoPlaneStatic, SimulatedIntervention
    from eve.intervention import device as devices_of_eve
    from eve.intervention import simulation as simulations_of_eve
    from eve.intervention import target as targets_of_eve
    from eve.intervention import vesseltree as trees_of_eve
    from eve.intervention.fluoroscopy import TrackingOnly
    from eve.intervention.vesseltree.util.branch import calc_branching_with_radii
    from eve.intervention.vesseltree.vesseltree import Insertion
    from eve.util.coordtransform import tracking3d_to_2d, vessel_cs_to_tracking3d
    from gymnasium.spaces import Box
except ImportError as error:
    raise ImportError(
        f"seldinger.compat.eve runs stEVE on Seldinger's physics, and stEVE cannot be imported: {error}. Get stEVE from its "
        "repository lkarstensen/stEVE on GitHub and install it with 'pip install -e stEVE'; its SOFA is not needed. "
        "A package `eve` of another project does not do") from error

__all__ = ["ArchVariety", "BasicWireNav", "Device", "DualDeviceNav", "Fluoroscopy", "Intervention", "Simulation", "VesselTree",
           "over"]

_PATIENCE = 30  # steps in a row without equilibrium to a simulation error, as in seldinger.gym


class _Module(str):
    """This module's name, which passes as one of stEVE's: save_config() writes objects of other modules as their base class,
    and does not return where that is none of stEVE's."""

    def startswith(self, prefix: Any, *within: Any) -> bool:
        return prefix == "eve." or str.startswith(self, prefix, *within)


class _Ours:
    """Configurations keep it as it is; so do copies and pickles, but for the simulation, which is made again when asked for."""

    def __new__(cls, *_: Any, **__: Any) -> Any:
        made = super().__new__(cls)
        made.__module__ = _Module(cls.__module__)
        return made

    def __getstate__(self) -> dict[str, Any]:
        return {key: None if key in ("_core", "_state") else value for key, value in self.__dict__.items()}


def _folder(cache: Any) -> Optional[str]:
    return None if cache is None else os.fspath(cache)


class Device(_Ours, devices_of_eve.Device):
    """A device of a scenario: what stEVE's parts read of one."""

    def __init__(self, name: str, velocity_limit: Sequence[float], length: float, diameter: float) -> None:
        self.name, self.velocity_limit, self.length, self.diameter = name, tuple(velocity_limit), length, diameter

    @property
    def sofa_device(self) -> "Device":
        """Its radius, where stEVE looks for it."""
        return self

    @property
    def radius(self) -> float:
        """Outer, of the shaft [mm]."""
        return 0.5 * self.diameter


class VesselTree(_Ours, trees_of_eve.VesselTree):
    """The vessels of a scenario [mm]: +x is the patient's left, +y the back, +z the head. Centrelines end where the longest
    device does.

    scenario, set, cache   as for seldinger.Simulation
    anatomy_seed           (first, end): a reset draws other vessels, as seldinger.gym's randomize does
    """

    def __init__(self, scenario: Any, set: Optional[Mapping[str, Any]] = None, anatomy_seed: Optional[Sequence[int]] = None,
                 cache: Any = None) -> None:
        self.scenario, self.set, self.anatomy_seed, self.cache = scenario, dict(set or {}), anatomy_seed, _folder(cache)
        self._rng = np.random.default_rng()
        self._seed: Optional[int] = None
        self._core: Optional[Core] = None
        if anatomy_seed is not None:
            try:
                first, end = (int(seed) for seed in anatomy_seed)
                fit = 0 <= first < end
            except (TypeError, ValueError):
                fit = False
            if not fit:
                raise InputError(f"anatomy_seed: {anatomy_seed!r} was given; expected (first, end) of seeds, two whole "
                                 "numbers of 0 or more")
            self._seed = first
        self.mesh_path = self.visu_mesh_path = None
        self._read()

    @property
    def core(self) -> Core:
        """The simulation of a wire in these vessels."""
        if self._core is None or self._core.closed:
            values = dict(self.set) if self._seed is None else {**self.set, "anatomy.seed": self._seed}
            self._core = Core(self.scenario, set=values, cache=self.cache)
        return self._core

    def reset(self, episode_nr: int = 0, seed: Optional[int] = None) -> None:
        """Draws other vessels where anatomy_seed was given."""
        if self.anatomy_seed is None:
            return
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        for _ in range(50):
            self._seed, before = int(self._rng.integers(*self.anatomy_seed)), self._seed
            if self._seed == before:
                return
            self._core = None
            try:
                self._read()
                return
            except InputError:  # the scenario's devices or target do not fit these vessels: others are drawn
                continue
        raise InputError(f"anatomy_seed: none of 50 anatomies of the seeds {self.anatomy_seed} takes the scenario's devices")

    def _read(self) -> None:
        about, anatomy = self.core.about(), self.core.anatomy()
        reach = max(about["device_lengths_mm"])
        begin = self.core.state.wire_mm[0]
        lines: list[Floats] = []
        ways: list[Floats] = []
        branches = []
        for one in anatomy["branches"]:
            points, radii, parent = one["points_mm"], one["radii_mm"], one["parent"]
            # stEVE's branches begin on the parent's centreline.
            start = 0.0
            if parent >= 0:
                k = int(np.linalg.norm(lines[parent] - points[0], axis=1).argmin())
                points, radii = np.vstack([lines[parent][k], points]), np.append(radii[0], radii)
                start = ways[parent][k]
            way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
            if parent < 0:
                entry = int(np.linalg.norm(points - begin, axis=1).argmin())
                start = 0.0
                way = np.abs(way - way[entry])
            lines.append(points)
            ways.append(start + way)
            near = np.flatnonzero(start + way <= reach)[::4]
            if len(near) > 1:
                branches.append(trees_of_eve.BranchWithRadii(one["name"], points[near].copy(), radii[near].copy()))
        self.branches = tuple(branches)
        self.branching_points = calc_branching_with_radii(self.branches)
        self.centerline_coordinates = np.concatenate([branch.coordinates for branch in self.branches])
        joints = self.core.state.wire_mm
        self.insertion = Insertion(joints[0], (joints[1] - joints[0]) / np.linalg.norm(joints[1] - joints[0]))
        low = np.min([branch.low for branch in self.branches], axis=0).astype(np.float32)
        high = np.max([branch.high for branch in self.branches], axis=0).astype(np.float32)
        self.coordinate_space = self.coordinate_space_episode = Box(low, high)


class Simulation(_Ours, simulations_of_eve.Simulation):
    """In place of SofaBeamAdapter: devices in the vessels of `vessel_tree`, this module's or one of stEVE whose branches have
    radii. friction is that of devices on the wall in vessels of stEVE; a scenario states its own."""

    def __init__(self, vessel_tree: Any, friction: float = 0.1, cache: Any = None) -> None:
        self.vessel_tree, self.friction, self.cache = vessel_tree, friction, _folder(cache)
        self.simulation_error = False
        self._closed = False
        self._rng = np.random.default_rng()
        self._devices: list[Any] = []
        self._core: Any = None  # Core, and its State, once there is one
        self._state: Any = None
        self._made_of: Any = None

    @property
    def core(self) -> Core:
        """The simulation of Seldinger."""
        self._require_state()
        return self._core

    @property
    def device_positions(self) -> Optional[list[Floats]]:
        """(n, 3) mm of each device, from its tip to the introducer."""
        if not self._devices:
            return None
        state = self._require_state()
        begin = np.asarray(self.vessel_tree.insertion.position, float).reshape(1, 3)
        joints = [getattr(state, name + "_mm")[::-1] for name in self._names]
        return [one if len(one) else begin for one in joints]

    @property
    def dof_positions(self) -> Optional[Floats]:
        """(n, 3) mm of the device that reaches farthest, from its tip to the introducer."""
        places = self.device_positions
        lengths = self.inserted_lengths
        return None if places is None or lengths is None else places[int(lengths.argmax())]

    @property
    def inserted_lengths(self) -> Optional[Floats]:
        """mm of each device."""
        places = self.device_positions
        return None if places is None else np.array(
            [np.linalg.norm(np.diff(one, axis=0), axis=1).sum() for one in places])

    @property
    def rotations(self) -> Optional[Floats]:
        """rad of each device's hub."""
        if not self._devices:
            return None
        self._require_state()
        return self._turned.copy()

    def reset(self, insertion_point: Any, insertion_direction: Any, mesh_path: Any, devices: Sequence[Any],
              coords_high: Any = None, coords_low: Any = None, vessel_visual_path: Any = None,
              seed: Optional[int] = None) -> None:
        """Takes the vessels as vessel_tree has them now. Devices stay where they are if the vessels did not change."""
        self._devices = list(devices)
        for _ in range(2):  # what reset_devices() draws after this does not depend on whether there were other vessels before
            if seed is not None:
                self._rng = np.random.default_rng(seed)
            if self._core is None or self._made_of is not self.vessel_tree.branches:
                self.reset_devices()

    def reset_devices(self) -> None:
        """Devices at the start, each turned to an angle that is drawn."""
        if not self._devices:
            raise InputError("no episode was begun; expected reset()")
        self._make()
        self.simulation_error, self._restless = False, 0
        self._core.reset()
        self._turned = np.zeros(len(self._devices))
        self._move(np.stack([np.zeros(len(self._devices)), self._rng.random(len(self._devices)) * 2 * np.pi], 1), 1)

    def step(self, action: Floats, duration: float = 1 / 7.5) -> None:
        """action (n, 2) mm/s and rad/s, for so long [s]; simulation_error after 30 in a row without equilibrium."""
        self._require_state()
        frames = max(1, round(duration * self._rate))
        self._move(np.asarray(action, float) * (duration / frames), frames)
        self._restless = 0 if self._state.at_rest else self._restless + 1
        self.simulation_error = self._restless >= _PATIENCE

    def close(self) -> None:
        """Frees the simulation. Nothing else is to be called then."""
        if self._core is not None:
            self._core.close()
        self._core, self._state, self._closed = None, None, True

    def add_interim_targets(self, positions: Sequence[Any]) -> list[Any]:
        """Nothing is drawn."""
        return []

    def remove_interim_target(self, interim_target: Any) -> None:
        """Nothing was drawn."""

    def _require_state(self) -> Any:
        if self._state is None:
            self.reset_devices()
        return self._state

    def _make(self) -> None:
        if self._closed:
            raise InputError("the intervention is closed; expected one that is open")
        if isinstance(self.vessel_tree, VesselTree):
            self._core = self.vessel_tree.core
        elif self._core is None or self._made_of is not self.vessel_tree.branches:
            # The wall wants branches apart by a third of their radius, which some of stEVE's are not.
            for width in (1.0, 0.95, 0.9, 0.85):
                try:
                    tree, shapes = self.vessel_tree, [device.sofa_device for device in self._devices]
                    self._core = Core(in_branches(tree.branches, tree.insertion.position, shapes, self.friction, width),
                                      cache=self.cache)
                    break
                except InputError:
                    if width == 0.85:
                        raise
        self._made_of = self.vessel_tree.branches
        about = self._core.about()
        self._names, self._rate = about["device_names"], about["frame_rate_hz"]

    def _move(self, motion: Floats, frames: int) -> None:
        """(n, 2) mm and rad in each frame."""
        turn = np.degrees(motion[:, 1])
        if len(motion) <= 2:
            other = {} if len(motion) == 1 else {"catheter_advance_mm": motion[1, 0], "catheter_rotate_deg": turn[1]}
            self._state = self._core.step(motion[0, 0], turn[0], frames=frames, **other)
        for _ in range(frames if len(motion) > 2 else 0):
            for name, feed, angle in zip(self._names, motion[:, 0], turn):
                if feed:
                    self._core.apply(f"{'advance' if feed > 0 else 'withdraw'} {name} {abs(feed):.9f} mm")
                if angle:
                    self._core.apply(f"rotate {name} {angle:.9f} deg")
            self._state = self._core.step()
        self._turned = self._turned + frames * motion[:, 1]


class Fluoroscopy(_Ours, TrackingOnly):
    """TrackingOnly with the X-ray image (image_size, image_size) uint8, made when it is asked for, and each device's own track.
    Tracking is parallel to the rays in the middle, in mm, as in stEVE; the image has the rays of a C-arm."""

    def __init__(self, simulation: Simulation, vessel_tree: Any, image_frequency: float = 7.5,
                 image_rot_zx: Optional[Sequence[float]] = None, image_center: Optional[Sequence[float]] = None,
                 field_of_view: Optional[Sequence[float]] = None, image_size: int = 128) -> None:
        super().__init__(simulation, vessel_tree, image_frequency, image_rot_zx, image_center, field_of_view)
        if not isinstance(image_size, (int, np.integer)) or not 32 <= image_size <= 2048:
            raise InputError(f"image_size: {image_size!r} was given; expected a whole number of 32 to 2048")
        self.image_size = image_size

    @property
    def image_space(self) -> Box:
        return Box(0, 255, (self.image_size, self.image_size), np.uint8)

    @property
    def image(self) -> Floats:
        return self.simulation.core.image(self.image_size)

    @property
    def device_trackings3d(self) -> list[Floats]:
        return [self._seen(places) for places in self.simulation.device_positions]

    @property
    def tracking3d_space(self) -> Box:
        # All corners: turned, two opposite ones span another box.
        space = self.vessel_tree.coordinate_space
        corners = self._seen(np.array(np.meshgrid(*zip(space.low, space.high))).reshape(3, -1).T)
        return Box(corners.min(0), corners.max(0))

    @staticmethod
    def tracking3d_to_2d(places: Floats) -> Floats:
        """(n, 2) of (n, 3), as stEVE's pathfinders ask for it."""
        return tracking3d_to_2d(places)

    def _seen(self, places: Floats) -> Floats:
        return vessel_cs_to_tracking3d(places, self.image_rot_zx, self.image_center, self.field_of_view)


class _OwnTarget(_Ours, targets_of_eve.Manual):
    """The scenario's, in the vessels as they are; with the coordinates2d that Manual lacks."""

    def __init__(self, vessel_tree: VesselTree, threshold: float, fluoroscopy: Fluoroscopy) -> None:
        self.vessel_tree = vessel_tree
        super().__init__([], threshold, fluoroscopy)

    @property
    def coordinates2d(self) -> Floats:
        return tracking3d_to_2d(self.coordinates3d)

    def reset(self, episode_nr: int = 0, seed: Optional[int] = None) -> None:
        self.targets_vessel_cs = [self.vessel_tree.core.state.target_mm]
        super().reset(episode_nr, seed)


class _OnSeldinger(_Ours, MonoPlaneStatic):
    """MonoPlaneStatic over Simulation: no mesh is made for SOFA, and no process watches over a step."""

    def __init__(self, vessel_tree: Any, devices: Sequence[Any], simulation: Simulation, fluoroscopy: Any, target: Any,
                 stop_device_at_tree_end: bool = True, normalize_action: bool = False) -> None:
        super().__init__(vessel_tree, list(devices), simulation, fluoroscopy, target, stop_device_at_tree_end,
                         normalize_action)
        self.normalize_action = normalize_action

    def reset(self, episode_number: int = 0, seed: Optional[int] = None, options: Optional[dict[str, Any]] = None) -> None:
        """Begins an episode. The same seed draws the same vessels and targets as in stEVE; vessels that are refused, because
        branches run through each other, are drawn again."""
        if seed is not None:
            self._np_random = np.random.default_rng(seed)
        vessel_seed = None if seed is None else int(self._np_random.integers(0, 2 ** 31))
        self.vessel_tree.reset(episode_number, vessel_seed)
        for tries in range(20):
            place, vessels = self.vessel_tree.insertion, self.vessel_tree.branches
            try:
                self.simulation.reset(place.position, place.direction, None, self.devices, seed=seed)
                break
            except InputError:  # a few of the arches that stEVE draws have branches that run through each other
                self.vessel_tree.reset(episode_number, None)
                if self.vessel_tree.branches is vessels or tries == 19:
                    raise
        target_seed = None if seed is None else int(self._np_random.integers(0, 2 ** 31))
        self.target.reset(episode_number, target_seed)
        self.fluoroscopy.reset(episode_number)
        self.last_action = np.zeros_like(self.velocity_limits)

    def step(self, action: Floats) -> None:
        """(n, 2) of feed and turn of each device, in mm/s and rad/s, or -1 to 1 with normalize_action."""
        if not np.isfinite(np.asarray(action, float)).all():
            raise InputError(f"action: {action!r} was given; expected finite numbers")
        if self.simulation.inserted_lengths is None:
            raise InputError("no episode was begun; expected reset()")
        super().step(action)

    def make_mp(self, step_timeout: float = 2, restart_n_resets: int = 200) -> None:
        """Does nothing: a step cannot hang."""

    def make_non_mp(self) -> None:
        """Does nothing."""


class Intervention(_OnSeldinger):
    """A scenario of Seldinger.

    scenario, set, cache    as for seldinger.Simulation
    velocity_limit          largest speeds [mm/s, rad/s], of all devices or a row for each
    image_frequency         steps a second, rounded to whole frames of the scenario
    image_rot_zx            view of tracking [deg], by default the C-arm's; image_size: pixels of fluoroscopy.image
    target_branches         a target is drawn on their centrelines; None: the scenario's own
    target_threshold        how near the tip must come [mm], by default the scenario's
    anatomy_seed            (first, end): a reset draws other vessels
    """

    def __init__(self, scenario: Any = "renal", *, velocity_limit: Sequence[float] = (35.0, 3.14),
                 image_frequency: float = 7.5, image_rot_zx: Optional[Sequence[float]] = None, image_size: int = 128,
                 target_branches: Optional[Sequence[str]] = None, target_threshold: Optional[float] = None,
                 anatomy_seed: Optional[Sequence[int]] = None, stop_device_at_tree_end: bool = True,
                 normalize_action: bool = False, set: Optional[Mapping[str, Any]] = None, cache: Any = None) -> None:
        self.scenario, self.set, self.cache, self.anatomy_seed = scenario, set, _folder(cache), anatomy_seed
        self.velocity_limit, self.image_frequency, self.image_size = velocity_limit, image_frequency, image_size
        self.image_rot_zx, self.target_branches, self.target_threshold = image_rot_zx, target_branches, target_threshold
        if not isinstance(image_frequency, (int, float)) or not 0.001 <= image_frequency <= 1000:
            raise InputError(f"image_frequency: {image_frequency!r} was given; expected a number from 0.001 to 1000")
        tree = VesselTree(scenario, set, anatomy_seed, cache)
        about = tree.core.about()
        threshold = about["target_radius_mm"] if target_threshold is None else target_threshold
        if not isinstance(threshold, (int, float)) or not 0 < threshold < math.inf:
            raise InputError(f"target_threshold: {target_threshold!r} was given; expected a number above 0")
        try:
            limits = np.broadcast_to(np.asarray(velocity_limit, float), (about["devices"], 2))
            fit = bool(np.isfinite(limits).all() and (limits > 0).all())
        except (TypeError, ValueError):
            fit = False
        if not fit:
            raise InputError(f"velocity_limit: {velocity_limit!r} was given; expected two numbers above 0, mm/s and rad/s, or "
                             f"a row of them for each of {about['devices']} devices")
        devices = [Device(name, tuple(limit), length, diameter) for name, limit, length, diameter in zip(
            about["device_names"], limits.tolist(), about["device_lengths_mm"], about["device_diameters_mm"])]
        simulation = Simulation(tree, cache=cache)
        view = [about["lao_deg"], -about["cranial_deg"]] if image_rot_zx is None else list(image_rot_zx)
        fluoroscopy = Fluoroscopy(simulation, tree, image_frequency, view, image_size=image_size)
        if target_branches is None:
            target: Any = _OwnTarget(tree, threshold, fluoroscopy)
        else:
            unknown = [name for name in target_branches if name not in tree.keys()]
            if unknown:
                raise InputError(f"target_branches: '{unknown[0]}' was given; expected " + ", ".join(tree.keys()))
            target = targets_of_eve.CenterlineRandom(tree, fluoroscopy, threshold, list(target_branches))
        super().__init__(tree, devices, simulation, fluoroscopy, target, stop_device_at_tree_end, normalize_action)


def over(intervention: SimulatedIntervention, cache: Any = None) -> MonoPlaneStatic:
    """An intervention of stEVE on the physics of Seldinger: its own vessels, devices, fluoroscopy and target, as
    over(eve_bench.ArchVariety()). Its vessels must have radii, its devices be JShaped or Straight. It gives its parts away."""
    simulation = Simulation(intervention.vessel_tree, getattr(intervention.simulation, "friction", 0.1), cache)
    intervention.fluoroscopy.simulation = simulation
    return _OnSeldinger(intervention.vessel_tree, intervention.devices, simulation, intervention.fluoroscopy,
                        intervention.target, intervention.stop_device_at_tree_end,
                        getattr(intervention, "normlaize_action", intervention.normalize_action))


def _bench_wire() -> Any:
    """The guidewire of BasicWireNav and ArchVariety."""
    return devices_of_eve.JShaped(name="guidewire", velocity_limit=(35, 3.14), length=450, tip_radius=12.1,
                                  tip_angle=0.4 * math.pi, tip_outer_diameter=0.7, straight_outer_diameter=0.89,
                                  poisson_ratio=0.49, young_modulus_tip=17e3, young_modulus_straight=80e3,
                                  beams_per_mm_straight=0.5)


class ArchVariety(_OnSeldinger):
    """stEVE_bench's ArchVariety: arches of type I that stEVE draws, a wire of 450 mm, targets in the branches of the arch.
    The same seed gives the same vessels and target."""

    def __init__(self, episodes_between_arch_change: int = 1, stop_device_at_tree_end: bool = True,
                 normalize_action: bool = False, image_size: int = 128, cache: Any = None) -> None:
        self.image_size, self.cache = image_size, _folder(cache)
        tree = trees_of_eve.AorticArchRandom(episodes_between_change=episodes_between_arch_change,
                                             scale_diameter_array=[0.85], arch_types_filter=[trees_of_eve.ArchType.I])
        simulation = Simulation(tree, 0.1, cache)
        fluoroscopy = Fluoroscopy(simulation, tree, 7.5, [25, 0], [0, 0, 0], image_size=image_size)
        target = targets_of_eve.CenterlineRandom(tree, fluoroscopy, 5, ["lcca", "rcca", "lsa", "rsa", "bct", "co"])
        super().__init__(tree, [_bench_wire()], simulation, fluoroscopy, target, stop_device_at_tree_end, normalize_action)

    @property
    def episodes_between_arch_change(self) -> int:
        """Episodes with one arch."""
        return self.vessel_tree.episodes_between_change


class BasicWireNav(Intervention):
    """stEVE_bench's BasicWireNav: its wire, speeds, view, threshold and task, in an arch of type I of ours, because the
    vascular model 0011_H_AO_H is not ours to ship. anatomy_seed: (first, end) of other patients, one for each episode."""

    def __init__(self, stop_device_at_tree_end: bool = True, normalize_action: bool = False, image_size: int = 128,
                 anatomy_seed: Optional[Sequence[int]] = None, cache: Any = None) -> None:
        wire = _bench_wire()
        super().__init__(in_arch([wire.sofa_device], 0.1, [0, 0]), velocity_limit=wire.velocity_limit, image_rot_zx=[0, 0],
                         image_size=image_size, target_threshold=5.0,
                         target_branches=["brachiocephalic+RSA", "RCCA+RICA", "LCCA+LICA", "LSA"],
                         anatomy_seed=anatomy_seed, stop_device_at_tree_end=stop_device_at_tree_end,
                         normalize_action=normalize_action, cache=cache)
        self.devices = [wire]


class DualDeviceNav(Intervention):
    """stEVE_bench's DualDeviceNav: its microwire and microcatheter, speeds, view, threshold and task, in an arch of type I of
    ours from the descending aorta on, because the model of its vessels is not ours to ship. anatomy_seed: as BasicWireNav."""

    def __init__(self, stop_device_at_tree_end: bool = True, normalize_action: bool = False, image_size: int = 128,
                 anatomy_seed: Optional[Sequence[int]] = None, cache: Any = None) -> None:
        common = dict(length=900, velocity_limit=(35, 3.14), young_modulus_tip=1e3, young_modulus_straight=1e3,
                      mass_density_tip=5e-6, mass_density_straight=5e-6, beams_per_mm_straight=0.6)
        devices = [devices_of_eve.JShaped(name="mic_guide", tip_outer_diameter=0.36, straight_outer_diameter=0.36,
                                          straight_inner_diameter=0.36, **common),
                   devices_of_eve.JShaped(name="mic_cath", tip_outer_diameter=0.6, straight_outer_diameter=0.7,
                                          tip_inner_diameter=0.57, straight_inner_diameter=0.57, **common)]
        super().__init__(in_arch([one.sofa_device for one in devices], 0.001, [20, 5]), velocity_limit=(35, 3.14),
                         image_rot_zx=[20, 5], image_size=image_size, target_threshold=5.0,
                         target_branches=["LCCA+LICA", "LVA", "RCCA+RICA", "RVA"], anatomy_seed=anatomy_seed,
                         stop_device_at_tree_end=stop_device_at_tree_end, normalize_action=normalize_action, cache=cache)
        self.devices = devices

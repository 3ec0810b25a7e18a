#pragma once
/// Texts of the Python module: shapes, units, errors.

namespace app::docs {

inline constexpr const char* input_error =
    "An input that the engine rejects. The text is the engine's: one problem a line, where it is, what was "
    "found,\nwhat was expected. A subclass of ValueError.";

inline constexpr const char* state =
    "The state after a frame. Places are in the patient's coordinates in mm (x to the patient's left, y to "
    "the back,\nz to the head), where breath and heartbeat have moved them; pixels count from the image's "
    "left "
    "and top, at the\nscenario's c_arm.pixels and the C-arm as it is. Arrays belong to this state: later "
    "steps "
    "do not change them.";
inline constexpr const char* hash =
    "hash of the whole state, 64 bits. Two simulations of one scenario with the same hash never diverge";

inline constexpr const char* asdict = "All attributes as a dict: numbers, texts, truth values and arrays.";

inline constexpr const char* snapshot =
    "The whole state of a simulation, made by Simulation.snapshot(). len() is its size in bytes.";

inline constexpr const char* step =
    R"(Makes one frame (1/frame_rate_hz s), or several with the same motions, and returns the State after it.

advance_mm   feeds the device, below 0 draws it back [mm], -500 to 500 in each frame
rotate_deg   turns its hub, right-handed about the device [deg], -36000 to 36000 in each frame
device       its name ('wire', 'catheter', ...) or its place, 0 = the wire; or 'all': what the two above are made with
catheter_advance_mm, catheter_rotate_deg   the same of the catheter, in the same frame
frames       how many frames [1]

Commands given to apply() before take effect first; a step that is refused keeps them. Motions that a frame's budget does not allow wait for later
frames, in order. Other threads of Python run meanwhile; Ctrl-C ends the call after the frame that is being made.
Raises InputError for values out of range and for a catheter that is not there; then no frame was made.)";
inline constexpr const char* apply =
    R"(Asks for a command, as in a script but without its frame: 'arm lao 30 deg', 'beam on', 'mode dsa',
'inject 6 ml at 3 ml/s through catheter', 'exchange wire rosen035'. It takes effect with the next step; image() and
masks() already see the C-arm, table and collimator. Raises InputError for a line that is no command and for one that
this scenario does not accept. Whether an injection or an exchange can be made is found by the step, which raises
InputError and forgets it when not.)";
inline constexpr const char* state_now =
    "State: the state as it is, after construction, reset, restore or a step.";
inline constexpr const char* reset =
    R"(Restores the state after construction, bit for bit, and returns it. Takes less than a millisecond.

target      another target for the attempts from now on: the name of one of anatomy()['targets'], or a place (3,) [mm],
            finite and up to 10000 in size
radius_mm   its radius, 0.1 to 100 [mm]

The recording begins anew. Raises InputError for a target that does not exist or lies outside the vessels; the state
is then that after a reset with the old target.)";
inline constexpr const char* take_snapshot =
    "Returns a Snapshot of the whole state, its recording included: for planning and going back.";
inline constexpr const char* restore =
    "Restores a Snapshot of a simulation of the same scenario and target: the next states are equal bit for "
    "bit.\n"
    "Raises InputError for another's, and changes nothing.";
inline constexpr const char* image =
    R"(An X-ray image of the state as it is: (pixels, pixels) uint8. Made only when asked for; it adds no dose to the score.

pixels   32 to 2048 along a side; by default the scenario's, and with 'screen' no others
mode     'live': one pulse of fluoroscopy. 'cine': one pulse of cine. 'dsa': one pulse of subtraction from a mask without devices and contrast.
         'screen': the room's screen with lag, DSA and roadmap, as beam and mode were; needs images=True.
seed     of the noise; by default the scenario's. The noise also depends on the number of the frame.

The first image of a pose takes longer than the others. Raises InputError for sizes and modes out of range.)";
inline constexpr const char* panel =
    R"(The room's panel: (height, width, 3) uint8, the image with readouts, forces and messages around it. Needs panel=True.
With images=True its image is the room's screen, else one pulse of fluoroscopy as by image(), which adds no dose.

width, height   640 to 4096 and 512 to 4096 pixels
seed            of the pulse's noise

Raises InputError for sizes out of range, and without panel=True.)";
inline constexpr const char* masks =
    R"(Truth of image(pixels): a dict of (pixels, pixels) uint8 arrays, 255 where the ray meets the thing, else 0:
'vessels', and each device by its name: 'wire', 'catheter'. Raises InputError for sizes out of 32 to 2048.)";
inline constexpr const char* project =
    "Projects places (n, 3) [mm] into an image of `pixels` along a side, by default the scenario's: (n, 2) "
    "float64,\n"
    "x to the right, y down, from the image's left and top.";
inline constexpr const char* camera_matrix =
    "(3, 4) float64 P of (x w, y w, w) = P (place, 1), consistent with project(); w is the depth [mm].";
inline constexpr const char* save =
    "Writes the commands since the start or the last reset() as a recording (.gw), with hashes of states:\n"
    "'seldinger replay' and 'run' play it. Raises InputError when the file cannot be written, and where it "
    "is one\n"
    "that the scenario is read from.";
inline constexpr const char* close = "Frees what it simulates. Later calls raise InputError.";
inline constexpr const char* closed = "bool: close() was called.";
inline constexpr const char* anatomy =
    R"(The vessels as a dict: 'name', 'branches' (list of dicts: 'name', 'parent' (index, -1 for a root), 'points_mm' (n, 3),
'radii_mm' (n,)), 'ends' (names of open ends), 'targets' (list of dicts: 'name', 'branch', 'centre_mm' (3,)) and
'vertices_mm' (n, 3) of the lumen's mesh.)";
inline constexpr const char* about =
    "The scenario as a dict: name, title, frame_rate_hz, time_limit_s (or None), devices (how many), "
    "device_names, device_lengths_mm, "
    "device_diameters_mm, target_by (one of\n"
    "the names), target_radius_mm, pixels, field_mm (of view, at the isocentre), lao_deg, cranial_deg (of "
    "the C-arm at the start), "
    "wire_length_mm.";
inline constexpr const char* path_from =
    "float: way from a place (3,) [mm] to the target along centrelines [mm]; None where there is none. "
    "Raises\nInputError for places that are not finite or beyond 10000 mm.";

inline constexpr const char* route =
    R"(Points on the ways along centrelines to the targets, from the centreline's samples nearest to the tips.

points       how many, 1 to 1000; where a way ends before, its last point is repeated
spacing_mm   from each to the next, above 0 to 100

Returns (n, points, 3) float64 [mm], where they are now, and (n, points, 2) float64, pixels of the scenario's image.)";

inline constexpr const char* threads = "int: threads that make the frames, the caller's among them.";
inline constexpr const char* vector_step =
    R"(Makes a frame of each simulation, or several with the same motions, and updates the arrays.

motions   (n, devices, 2) float64, innermost first, or of fewer: feed [mm] and turn [rad] in each frame
frames    how many frames [1]
active    (n,) bool: only these make frames; by default all. Indices are refused

Results do not depend on the number of threads. Ctrl-C ends the call after the frame that is being made. Raises
InputError for shapes and values out of range, before any frame was made.)";
inline constexpr const char* vector_reset =
    "Restores the start of all simulations, or of those in which = (n,) bool, bit for bit.";
inline constexpr const char* aim =
    "Resets the i-th simulation with another target: a name or a place (3,) [mm], and its radius [mm]. "
    "Raises\nInputError for one that does not exist or lies outside the vessels; it is then reset with the "
    "old target.";
inline constexpr const char* vector_apply =
    "Asks for a command with the next frame of the i-th simulation, as Simulation.apply.";
inline constexpr const char* hashes =
    "(n,) uint64: State.hash of each simulation; with asked=True of its target and of what apply() has asked "
    "for, too.";
inline constexpr const char* show_tip =
    "Moves the table of the i-th simulation, with its next frame, so that the tip is in the image, `margin` "
    "of its\nwidth from the edges. Nothing where it is.";
inline constexpr const char* branch_name = "str: the branch that the i-th tip is in.";
inline constexpr const char* vector_save = "Writes the recording of the i-th simulation, as Simulation.save.";
inline constexpr const char* images =
    "(n, pixels, pixels) uint8: Simulation.image of each; seeds: a list of n, by default the scenario's.";
inline constexpr const char* vector_masks =
    "Dict of (n, pixels, pixels) uint8 arrays: Simulation.masks of each.";
inline constexpr const char* write_png =
    "Writes a PNG of uint8 (H, W), grey, or (H, W, 3), red, green, blue; of bool, True is written as 255. "
    "Raises\n"
    "InputError for other arrays and for a file that cannot be written.";

}  // namespace app::docs

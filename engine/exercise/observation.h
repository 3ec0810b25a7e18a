#pragma once
/// What can be observed of an exercise after a frame, and the one table of its fields. From the table follow
/// State and the arrays of Python, the lines of `serve`, the columns of a trace, type stubs and the list in
/// docs/python.md: a quantity is written there and nowhere else. A trace
/// has a row per frame and device: where each device is and what the hand feels of it.

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "engine/anatomy/vessel_paths.h"
#include "engine/exercise/frame.h"
#include "engine/exercise/score.h"
#include "physics/geometry/polyline.h"
#include "physics/geometry/vec.h"

namespace exercise {

class Exercise;

using Place = std::array<double, 3>;
struct InImage {
    double x = 0, y = 0;  // to the right, down [pixels]
};
/// A number of each device of the scenario, innermost first; 0 beyond its last.
struct OfDevices {
    std::array<double, script::most_devices> of = {};
};
/// Index of a branch of the anatomy.
enum class Branch : std::int64_t { None = -1 };
std::string name_of(Branch, const anatomy::Anatomy&);  // empty for none

inline constexpr double absent = std::numeric_limits<double>::quiet_NaN();

/// Plain numbers, which Python has as a record of NumPy. Places are those of the room at the frame's end:
/// breath and heartbeat have moved them. What the fields are is in fields().
struct Observation {
    std::int64_t frame = -1, run_frame = -1;
    double time = 0;
    script::DeviceRole device = script::DeviceRole::Wire;
    OfDevices inserted, turned;
    Place tip = {}, direction = {};
    Branch branch = Branch::None;
    double along = 0, path_to_target = absent, tip_to_target = 0;
    OfDevices push, torque, bow;
    double tip_force = 0, wall_force = 0, vessel_moved = 0;
    double tip_error = absent, wall_force_error = absent;
    double tip_error_wall = absent, tip_error_vessels = absent, tip_error_twist = absent;
    double device_tip_force = 0, device_wall_force = 0;
    std::int64_t contacts = 0;
    double friction_loss = 0;
    double end_force = 0, leaked_blood = 0, leaked_iodine = 0;
    std::int64_t dissections = 0, perforations = 0;
    bool settling = false;
    double air_kerma = 0, area_product = 0;
    double pressure = 0, systolic = 0, diastolic = 0, mean_pressure = 0, ecg = 0;
    double balloon_pressure = absent, balloon_diameter = absent, lumen = absent, gradient = absent;
    Place target = {}, shift = {};
    double target_radius = 0;
    InImage tip_px = {}, target_px = {};
    bool at_rest = true, certified = true, refused = false, buckled = false, too_thick = false,
         past_vessel_end = false, withdrawal_stopped = false, whole_wire_is_in = false, completed = false,
         on_target = false, time_is_up = false;
};
static_assert(std::is_trivially_copyable_v<Observation> && std::is_standard_layout_v<Observation>);

struct Field {
    std::string_view name;    // in State and `serve`, with its unit; empty = in the trace alone
    std::string_view column;  // of the trace, x, y and z in place of ?; empty = none
    std::string_view unit;    // as a text; empty for plain numbers
    std::string_view doc;
    std::variant<std::int64_t Observation::*, double Observation::*, bool Observation::*,
                 Place Observation::*, InImage Observation::*, OfDevices Observation::*,
                 Branch Observation::*, script::DeviceRole Observation::*>
        member;
};
/// In the order of a trace's columns. A field of all devices is the wire's; those of others have their name
/// as a prefix, `catheter_`.
std::span<const Field> fields();

/// Makes readings of one simulation.
class Reader {
public:
    explicit Reader(const Simulation&);
    /// Finds another target.
    void aim(const Simulation&);
    /// All but the tip and the target in the image. Tip, direction, branch and way are those of the device
    /// that the exercise is about.
    Observation read(const Exercise&) const;
    /// Those of that device, without dose, and without what is known of the attempt alone.
    Observation read(const Simulation&, const FrameTime&, script::DeviceRole) const;
    /// Adds the errors of discretisation and of models, which cost a part of a push and are absent otherwise.
    static void read_errors(const Simulation&, Observation&);
    /// Length of the shortest way along centrelines from a place to the target; empty without one [mm].
    std::optional<double> path_length_from(const Simulation&, const geometry::Vec3& place) const;
    /// Points on that way, `spacing` apart, of the vessels at rest, from the centreline's sample nearest to
    /// the place; all at the target where there is no way [mm].
    void points_to_target(const Simulation&, const geometry::Vec3& place, double spacing,
                          std::vector<geometry::Vec3>& points) const;

private:
    std::shared_ptr<const anatomy::VesselPaths> paths_;
    anatomy::VesselPlace target_;
};

/// Points on a device from its tip toward the introducer, so many at such a distance; where the device ends
/// before, its last point is repeated. `line` runs from the introducer to the tip; all zero where it is
/// empty.
void track(const geometry::Polyline& line, double spacing, std::vector<geometry::Vec3>& points);

class Trace {
public:
    explicit Trace(const Simulation& simulation) : reader_(simulation) {}

    /// Names and units of the columns, a line of CSV: those of fields() that have one.
    static std::string header();
    /// The rows of a frame, wire and catheter. A device that is out has empty cells for its place. Contacts
    /// are those of the joints at which the device lies outermost. Lengths, forces and torque are those of
    /// the wire shown: the last at rest. Forces and torque are positive where the hand must push and hold the
    /// hub back; an empty cell stands for a missing value: no way from the tip's branch to the target's, no
    /// dose without images.
    std::string rows(const Frame&, const Score&) const;

private:
    std::string row(std::size_t device, const Frame&, const Score&, const Observation& errors) const;

    Reader reader_;
};

}  // namespace exercise

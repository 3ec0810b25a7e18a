#include "engine/exercise/observation.h"

#include <algorithm>

#include "engine/exercise/exercise.h"
#include "engine/exercise/model_errors.h"
#include "engine/exercise/tip_pressure.h"
#include "engine/io/csv.h"
#include "physics/wire/energy.h"

namespace exercise {
namespace {

using geometry::Vec3;
using R = Observation;

// name, column, unit, doc, member
constexpr Field table[] = {
    {"", "frame", "", "frames of the run before this one", &R::run_frame},
    {"frame", "", "", "frames of the attempt before this one; -1 before the first", &R::frame},
    {"time_s", "time_s", "s", "time of the attempt at the frame's end", &R::time},
    {"", "device", "", "device that the row is of", &R::device},
    {"inserted_mm", "inserted_mm", "mm", "length of the device inside", &R::inserted},
    {"turned_deg", "turned_deg", "deg", "turn of the device's hub since the attempt began", &R::turned},
    {"tip_mm", "tip_?_mm", "mm", "tip of the device that the exercise is about; in a trace of the row's",
     &R::tip},
    {"tip_direction", "direction_?", "", "unit vector along the device at its tip", &R::direction},
    {"branch", "branch", "", "branch that is nearest to the tip: its name, in arrays its index", &R::branch},
    {"along_mm", "along_branch_mm", "mm", "from the branch's start along its centreline to the tip",
     &R::along},
    {"path_to_target_mm", "left_to_target_mm", "mm",
     "way from the tip to the target along centrelines; nan, null or empty where there is none",
     &R::path_to_target},
    {"push_N", "push_N", "N",
     "force with which the hand pushes the device, below 0 where it pulls, against wall, other devices and "
     "valve: of the wire shown, the last at rest",
     &R::push},
    {"torque_Nmm", "torque_N_mm", "N mm", "torque with which the hand holds the hub: of the wire shown",
     &R::torque},
    {"bow_mm", "bow_mm", "mm",
     "what the hand has fed that has not gone in, because the shaft outside has bowed", &R::bow},
    {"tip_force_N", "", "N", "force of the last joint of the chain of devices on the wall", &R::tip_force},
    {"wall_force_N", "", "N", "the largest force of one joint on the wall", &R::wall_force},
    {"vessel_moved_mm", "vessel_moved_mm", "mm", "the farthest that a joint has pushed a vessel aside",
     &R::vessel_moved},
    {"", "tip_force_N", "N", "force on the wall of the last joint at which the device lies outermost",
     &R::device_tip_force},
    {"", "wall_force_N", "N", "the largest force of a joint at which the device lies outermost",
     &R::device_wall_force},
    {"", "contacts", "", "joints on the wall at which the device lies outermost", &R::contacts},
    {"", "friction_loss_N_mm", "N mm",
     "work lost to friction with the wall, between devices and in their valves since the start",
     &R::friction_loss},
    {"end_force_N", "end_force_N", "N",
     "force that the foremost end of the devices is pushed against the wall with, along the device: what "
     "perforates",
     &R::end_force},
    {"dissections", "", "", "dissections of the wall in the attempt so far", &R::dissections},
    {"perforations", "", "", "perforations of the wall in the attempt so far", &R::perforations},
    {"leaked_blood_ml", "", "ml", "blood that has leaked through holes in the wall", &R::leaked_blood},
    {"leaked_iodine_mg", "", "mg", "iodine that has leaked with it and lies in the tissue",
     &R::leaked_iodine},
    {"settling", "settling", "",
     "the frame's budget ended on the way to rest; the wire shown is the last at rest", &R::settling},
    {"air_kerma_mGy", "air_kerma_mGy", "mGy",
     "air kerma of the attempt at the reference point, K_a,r; 0 (in a trace empty) where no dose is measured",
     &R::air_kerma},
    {"area_product_Gycm2", "", "Gy cm2",
     "kerma-area product of the attempt, P_KA; 0 where no dose is measured", &R::area_product},
    {"tip_to_target_mm", "", "mm", "straight from the tip to the target", &R::tip_to_target},
    {"target_mm", "", "mm", "middle of the target", &R::target},
    {"target_radius_mm", "", "mm", "radius of the target", &R::target_radius},
    {"shift_mm", "", "mm", "how far breath and heartbeat have moved the vessels", &R::shift},
    {"tip_px", "", "pixels", "the tip in the image, x to the right, y down", &R::tip_px},
    {"target_px", "", "pixels", "the target in the image", &R::target_px},
    {"at_rest", "", "", "the wire shown is an equilibrium within the solver's tolerance", &R::at_rest},
    {"certified", "", "", "at rest, a strict minimum of the energy, and no motion was refused or waits",
     &R::certified},
    {"refused", "", "", "a motion that led to no rest was not made", &R::refused},
    {"buckled", "", "", "a push was not passed on, because the shaft outside would have bowed", &R::buckled},
    {"too_thick", "", "", "a catheter stands before a vessel that is narrower than it", &R::too_thick},
    {"past_vessel_end", "", "", "the tip is past an end of the vessels, where they narrow and end",
     &R::past_vessel_end},
    {"withdrawal_stopped", "", "", "more was to be drawn back than leaves two segments inside",
     &R::withdrawal_stopped},
    {"whole_wire_is_in", "", "", "the device is in to its end, and more was asked for", &R::whole_wire_is_in},
    {"completed", "", "", "the tip has stayed in the target for the scenario's hold", &R::completed},
    {"on_target", "", "", "the tip is within the target's radius", &R::on_target},
    {"time_is_up", "", "", "the scenario's limit of time or beam is reached", &R::time_is_up},
    {"pressure_mmHg", "pressure_mmHg", "mmHg",
     "pressure now at the tip of the innermost catheter inside, as its bore passes it on; 0 (in a trace "
     "empty) "
     "without one, where its lumen is filled and while it is injected through",
     &R::pressure},
    {"systolic_mmHg", "systolic_mmHg", "mmHg", "the highest of that pressure in a beat", &R::systolic},
    {"diastolic_mmHg", "diastolic_mmHg", "mmHg", "the lowest of that pressure in a beat", &R::diastolic},
    {"mean_pressure_mmHg", "mean_pressure_mmHg", "mmHg", "mean of that pressure over a beat",
     &R::mean_pressure},
    {"ecg_mV", "ecg_mV", "mV", "electrocardiogram, as lead II has it", &R::ecg},
    {"balloon_pressure_atm", "balloon_pressure_atm", "atm",
     "pressure in the balloon, on the dial; nan, null or empty where there is no device with a balloon or "
     "stent",
     &R::balloon_pressure},
    {"balloon_diameter_mm", "balloon_diameter_mm", "mm",
     "the largest diameter of the balloon now; nan, null or empty where there is none", &R::balloon_diameter},
    {"lumen_mm", "lumen_mm", "mm",
     "diameter of the narrowest place of the first lesion; nan, null or empty where there is no lesion",
     &R::lumen},
    {"gradient_mmHg", "gradient_mmHg", "mmHg",
     "mean pressure before the first lesion less that behind it, with the devices and balloons in it; nan, "
     "null or empty where there is no lesion",
     &R::gradient},
    {"tip_error_mm", "tip_error_mm", "mm",
     "estimate of how far the foremost tip is from that of infinitely short segments; nan, null or empty "
     "where there is none, and nan in arrays, which do not pay for it",
     &R::tip_error},
    {"wall_force_error_N", "wall_force_error_N", "N",
     "the same of the largest force of one joint on the wall: what it would be less what it is",
     &R::wall_force_error},
    {"tip_error_wall_mm", "tip_error_wall_mm", "mm",
     "how far the tip would move with the lumen's mesh in place of the wall's field, right to its order "
     "alone; nan, null or empty where there is no such error or no estimate",
     &R::tip_error_wall},
    {"tip_error_vessels_mm", "tip_error_vessels_mm", "mm",
     "the same with vessels that make way, where they were left to stay", &R::tip_error_vessels},
    {"tip_error_twist_mm", "tip_error_twist_mm", "mm",
     "the same with shafts that their torque winds up, where they were left rigid", &R::tip_error_twist},
};

Place place_of(const Vec3& v) {
    return {v.x(), v.y(), v.z()};
}

void read_pressure(const Simulation& simulation, Observation& r) {
    r.ecg = ecg_at(simulation, simulation.time());
    const auto role = pressure_device(simulation);
    const auto at = role ? pressure_at_tip(simulation, *role) : std::nullopt;
    if (!at) return;
    r.pressure = at->now;
    r.systolic = at->systolic;
    r.diastolic = at->diastolic;
    r.mean_pressure = at->mean;
}

void read_treatment(const Simulation& simulation, Observation& r) {
    if (const Inflation* inflation = simulation.treatment().inflation()) {
        r.balloon_pressure = inflation->pressure;
        if (!inflation->radii.empty()) r.balloon_diameter = 2 * *std::ranges::max_element(inflation->radii);
    }
    r.lumen = narrowest_lumen(simulation).value_or(absent);
    r.gradient = pressure_drop(simulation).value_or(absent);
}

/// Contacts of the joints that the device bears: those that it is outermost at.
void read_contacts(const Simulation& simulation, Observation& r) {
    const auto contacts = simulation.contacts();
    const std::span<const scenario::PlacedDevice> devices = simulation.devices();
    double s = 0;
    for (std::size_t j = 1; j < contacts.size(); ++j) {
        s += simulation.wire().lengths[j];
        if (devices[simulation.wire().outermost(s)].role != r.device) continue;
        r.device_wall_force = std::max(r.device_wall_force, contacts[j].force());
        r.contacts += contacts[j].touches();
        r.device_tip_force = contacts[j].force();
    }
    if (!contacts.empty()) r.tip_force = contacts.back().force();
    r.wall_force = physics::largest_force(contacts);
    r.vessel_moved = simulation.farthest_vessel_move();
}

/// The cells of a field's value.
struct Cells {
    const anatomy::Anatomy& anatomy;
    std::size_t device;  // of the row
    std::vector<io::CsvCell>& cells;

    void operator()(std::int64_t value) const { cells.emplace_back(static_cast<double>(value)); }
    void operator()(double value) const { cells.emplace_back(value); }
    void operator()(bool value) const { cells.emplace_back(value ? 1.0 : 0.0); }
    void operator()(const Place& place) const { cells.insert(cells.end(), place.begin(), place.end()); }
    void operator()(const InImage& place) const {
        cells.emplace_back(place.x);
        cells.emplace_back(place.y);
    }
    void operator()(const OfDevices& value) const { cells.emplace_back(value.of[device]); }
    void operator()(Branch branch) const { cells.emplace_back(name_of(branch, anatomy)); }
    void operator()(script::DeviceRole held) const { cells.emplace_back(std::string(script::name_of(held))); }
};

}  // namespace

std::string name_of(Branch branch, const anatomy::Anatomy& anatomy) {
    return branch == Branch::None ? std::string() : anatomy.branches[static_cast<std::size_t>(branch)].name;
}

std::span<const Field> fields() {
    return table;
}

Reader::Reader(const Simulation& simulation)
    : paths_(std::make_shared<anatomy::VesselPaths>(simulation.anatomy())) {
    aim(simulation);
}

void Reader::aim(const Simulation& simulation) {
    target_ = anatomy::nearest_place(simulation.anatomy(), simulation.target());
}

std::optional<double> Reader::path_length_from(const Simulation& simulation, const Vec3& place) const {
    return paths_->between(anatomy::nearest_place(simulation.anatomy(), place), target_);
}

void Reader::points_to_target(const Simulation& simulation, const Vec3& place, double spacing,
                              std::vector<Vec3>& points) const {
    const anatomy::Anatomy& vessels = simulation.anatomy();
    const auto route = paths_->route(anatomy::nearest_place(vessels, place), target_);
    if (route.empty())
        std::fill(points.begin(), points.end(), simulation.target());
    else
        anatomy::points_on(vessels, route, spacing, points);
}

Observation Reader::read(const Simulation& simulation, const FrameTime& time, script::DeviceRole held) const {
    const anatomy::Anatomy& anatomy = simulation.anatomy();
    const Simulation::Tip tip = simulation.tip_of(held);
    const anatomy::VesselPlace place = anatomy::nearest_place(anatomy, tip.at);
    const Vec3 shift = simulation.vessel_shift();
    const Readings& last = simulation.readings();
    Observation r;
    r.frame = time.attempt;
    r.run_frame = time.index;
    r.time = time.seconds;
    r.device = held;
    for (std::size_t k = 0; k < simulation.devices().size(); ++k) {
        const script::DeviceRole role = simulation.devices()[k].role;
        const Hand hand = simulation.hand(role);
        r.inserted.of[k] = simulation.inserted(role);
        r.turned.of[k] = hand.turned / geometry::degree;
        r.push.of[k] = hand.load.push;
        r.torque.of[k] = hand.load.torque;
        r.bow.of[k] = hand.bow;
    }
    const geometry::Polyline path = simulation.carried_path_of(held);
    r.tip = place_of((path.empty() ? simulation.place_now(tip.at) - shift : path.back()) + shift);
    r.direction = place_of(tip.along);
    r.branch = Branch{place.branch};
    r.along = anatomy::along(anatomy, place);
    r.path_to_target = paths_->between(place, target_).value_or(absent);
    read_contacts(simulation, r);
    r.end_force = end_on_wall(simulation, foremost(simulation).role).end_on;
    r.dissections = simulation.injuries().count(InjuryKind::Dissection);
    r.perforations = simulation.injuries().count(InjuryKind::Perforation);
    for (const blood::Hole& hole : simulation.contrast().holes()) {
        r.leaked_blood += hole.blood;
        r.leaked_iodine += hole.iodine;
    }
    read_pressure(simulation, r);
    read_treatment(simulation, r);
    r.friction_loss = simulation.wire().friction_loss + simulation.wire().rub_loss;
    r.target = place_of(simulation.place_now(simulation.target()));
    r.target_radius = simulation.scenario().target.radius;
    r.shift = place_of(shift);
    r.tip_to_target = simulation.tip_to_target();
    r.settling = last.motion.settling;
    r.refused = last.motion.refused;
    r.buckled = last.motion.buckled;
    r.too_thick = last.motion.too_thick;
    r.past_vessel_end = last.motion.past_vessel_end;
    r.withdrawal_stopped = last.motion.withdrawal_stopped;
    r.whole_wire_is_in = last.motion.whole_wire_is_in;
    r.at_rest = last.at_rest && !r.settling;
    r.certified = r.at_rest && last.strict_minimum && !r.refused && !last.waits;
    r.on_target = r.tip_to_target <= r.target_radius;
    return r;
}

void Reader::read_errors(const Simulation& simulation, Observation& r) {
    const auto error = simulation.tip_error();
    r.tip_error = error ? error->tip : absent;
    r.wall_force_error = error ? error->wall_force : absent;
    const ModelErrors models = model_errors(simulation);
    r.tip_error_wall = models.wall.value_or(absent);
    r.tip_error_vessels = models.vessels.value_or(absent);
    r.tip_error_twist = models.twist.value_or(absent);
}

Observation Reader::read(const Exercise& exercise) const {
    const Simulation& simulation = exercise.simulation();
    Observation r = read(simulation, exercise.time(), simulation.scenario().target.device);
    if (const Dose* dose = exercise.dose()) {
        r.air_kerma = dose->air_kerma;
        r.area_product = dose->area_product;
    }
    r.completed = exercise.completed();
    r.time_is_up = exercise.frame() >= 0 && exercise.time_is_up();
    return r;
}

void track(const geometry::Polyline& line, double spacing, std::vector<Vec3>& points) {
    if (line.empty()) {
        std::ranges::fill(points, Vec3(Vec3::Zero()));
        return;
    }
    std::size_t i = line.size() - 1;
    Vec3 at = line.back();
    for (std::size_t k = 0; k < points.size(); ++k) {
        double left = k == 0 ? 0 : spacing;
        while (left > 0 && i > 0) {
            const double there = (line[i - 1] - at).norm();
            if (there > left) {
                at += (left / there) * (line[i - 1] - at);
                break;
            }
            left -= there;
            at = line[--i];
        }
        points[k] = at;
    }
}

std::string Trace::header() {
    std::vector<io::CsvCell> names;
    for (const Field& field : fields()) {
        if (field.column.empty()) continue;
        const std::size_t axis = field.column.find('?');
        for (const char name : std::string_view(axis == std::string_view::npos ? "?" : "xyz")) {
            std::string column(field.column);
            if (axis != std::string_view::npos) column[axis] = name;
            names.emplace_back(std::move(column));
        }
    }
    std::string text;
    io::append_row(text, names);
    return text;
}

std::string Trace::rows(const Frame& frame, const Score& score) const {
    std::string text;
    Observation errors;
    Reader::read_errors(frame.simulation, errors);
    for (std::size_t k = 0; k < frame.simulation.devices().size(); ++k) text += row(k, frame, score, errors);
    return text;
}

std::string Trace::row(std::size_t device, const Frame& frame, const Score& score,
                       const Observation& errors) const {
    Observation reading = reader_.read(frame.simulation, frame.time, frame.simulation.devices()[device].role);
    reading.air_kerma = score.air_kerma.value_or(absent);
    for (const auto error :
         {&Observation::tip_error, &Observation::wall_force_error, &Observation::tip_error_wall,
          &Observation::tip_error_vessels, &Observation::tip_error_twist})
        reading.*error = errors.*error;
    if (reading.mean_pressure == 0)
        reading.pressure = reading.systolic = reading.diastolic = reading.mean_pressure = absent;
    if (reading.inserted.of[device] <= 0) {
        reading.tip = reading.direction = {absent, absent, absent};
        reading.along = reading.path_to_target = absent;
        reading.branch = Branch::None;
    }
    std::vector<io::CsvCell> cells;
    const Cells add{frame.simulation.anatomy(), device, cells};
    for (const Field& field : fields())
        if (!field.column.empty()) std::visit([&](const auto member) { add(reading.*member); }, field.member);
    std::string text;
    io::append_row(text, cells);
    return text;
}

}  // namespace exercise

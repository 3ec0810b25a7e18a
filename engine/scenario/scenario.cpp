#include "engine/scenario/scenario.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/anatomy/grow/generate_run.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/script/command.h"

namespace scenario {
namespace {

constexpr double longest_tube = 5000;  // [mm]
constexpr double most_tube_triangles = 2e6;

/// What is wrong with the list of devices and with what the chain makes of them.
template <class Say>
void device_problems(const Scenario& s, const Say& say) {
    const double least = 1e-3;  // [mm]
    if (!(s.segment_length >= least && s.segment_length <= physics::DeviceLimits::segment_length))
        say("chain.segment_length_mm", fmt::format("expected segments of {:g} to {:g} mm, found {:g}", least,
                                                   physics::DeviceLimits::segment_length, s.segment_length));
    if (s.devices.empty()) return say("", "expected a wire, [guidewire], found no device");
    if (s.wire().role != script::DeviceRole::Wire)
        say(s.wire().section, fmt::format("expected a wire innermost, found a {}", s.wire().name()));
    const double bent = s.segment_length * largest_curvature(s.wire().device);
    if (bent > 1)
        say("chain.segment_length_mm",
            fmt::format(
                "expected segments at whose joints the unloaded tip turns by 57 degrees or less, found "
                "{:.0f} degrees: shorter segments, or a wider bend",
                bent / geometry::degree));
    for (std::size_t k = 0; k < s.devices.size(); ++k) {
        const PlacedDevice& placed = s.devices[k];
        const Device& device = placed.device;
        const std::string& section = placed.section;
        for (const std::string& text : physics::problems(device))
            say(section, fmt::format("[{}] {}", section, text));
        if (device.holding_friction() * s.wall_friction > physics::DeviceLimits::friction)
            say("wall.friction", fmt::format("expected a friction of up to {:g} on the wall, found a {} of "
                                             "friction {:g} on a wall that scales it by {:g}",
                                             physics::DeviceLimits::friction, placed.name(),
                                             device.holding_friction(), s.wall_friction));
        if (!placed.pinned && device.holding_valve_friction() == 0)
            say(section + ".pinned", fmt::format("a {} that is not pinned needs a valve that holds it; "
                                                 "expected valve_friction_N above 0 with pinned = false",
                                                 placed.name()));
        const bool innermost = k == 0;
        if (placed.inserted > device.length)
            say(innermost ? "entry.inserted_mm" : section + ".inserted_mm",
                fmt::format("a {} of {:g} mm cannot be in by {:g} mm; expected at most its length",
                            placed.name(), device.length, placed.inserted));
        if (!innermost && s.devices[k - 1].device.widest() >= device.inner_diameter)
            say(s.devices[k - 1].section + ".diameter_mm",
                fmt::format("a {} of {:g} mm does not fit a {}'s lumen of {:g} mm; expected a thinner one",
                            s.devices[k - 1].name(), s.devices[k - 1].device.widest(), placed.name(),
                            device.inner_diameter));
    }
    std::vector<physics::Device> on_this_wall(s.devices.size());
    for (std::size_t k = 0; k < s.devices.size(); ++k) {
        physics::DeviceSpec& spec = on_this_wall[k].spec = s.devices[k].device;
        spec.friction *= s.wall_friction;
        spec.static_friction *= s.wall_friction;
        if (s.torsion == TorsionModel::Rigid) physics::stiffen(spec);
    }
    if (const std::string why = physics::why_not(s.relaxer.kind, on_this_wall); !why.empty())
        say("relaxer.kind", why +
                                "; expected kind = \"global\", or devices that are frictionless = true and "
                                "torsion = \"rigid\" in [chain]");
    if (s.entry.sheath > 0 && s.entry.sheath < 2 * s.thickest_radius())
        say("entry.sheath_F",
            fmt::format("a sheath of {:g} F does not take a device of {:g} mm; expected {:g} F or more",
                        s.entry.sheath / french, 2 * s.thickest_radius(), s.usual_sheath() / french));
    if (s.devices.size() > physics::most_devices)
        say(s.devices.back().section, fmt::format("expected up to {} devices on one centreline, found {}",
                                                  physics::most_devices, s.devices.size()));
    if (!s.index_of(s.target.device))
        say("target.device",
            fmt::format("expected one of the scenario's devices, found '{}', which it has not",
                        script::name_of(s.target.device)));
}

}  // namespace

std::span<const DeviceKind> kinds_of(script::DeviceRole role) {
    static constexpr DeviceKind wires[] = {DeviceKind::Wire}, catheters[] = {DeviceKind::Catheter},
                                balloons[] = {DeviceKind::Balloon, DeviceKind::Stent};
    if (role == script::DeviceRole::Wire) return wires;
    if (role == script::DeviceRole::Balloon) return balloons;
    return catheters;
}

std::optional<int> Scenario::index_of(script::DeviceRole role) const {
    const auto found = std::ranges::find(devices, role, &PlacedDevice::role);
    if (found == devices.end()) return std::nullopt;
    return static_cast<int>(found - devices.begin());
}

std::string Scenario::patient_text() const {
    return patient.empty() ? "" : fmt::format("patient {}: {}", patient, patient_who);
}

io::TextPlace Scenario::place(const std::string& key) const {
    for (std::string at = key; !at.empty();) {
        if (const auto found = places.find(at); found != places.end()) return found->second;
        const auto dot = at.rfind('.');
        at = dot == std::string::npos ? "" : at.substr(0, dot);
    }
    const auto root = places.find("");
    return root == places.end() ? io::TextPlace{} : root->second;
}

std::vector<std::string> problems(const Scenario& s) {
    std::vector<std::string> found;
    const auto say = [&](const std::string& key, const std::string& text) {
        found.push_back(io::located(s.place(key), text));
    };
    if (int{!s.anatomy.empty()} + int{s.vessels.has_value()} + int{s.tube.has_value()} != 1) {
        say("", "expected one of 'anatomy' (a file), [anatomy] (to be grown) and [tube]");
    }
    for (const std::string& text : physics::problems(s.relaxer)) say("relaxer", "[relaxer] " + text);
    for (const std::string& text : render::problems(s.c_arm)) say("c_arm", "[c_arm] " + text);
    device_problems(s, say);
    if (s.imaging.pulse_rate && *s.imaging.pulse_rate > s.frame_rate)
        say("imaging.pulse_rate_hz", script::too_many_pulses(*s.imaging.pulse_rate, s.frame_rate));
    if (s.motion.moves() && !s.imaging.patient) {
        say("motion",
            "[motion] moves vessels before a body that stands still; expected [imaging] patient = true with "
            "it");
    }
    if (s.tissue.rigid == false && s.relaxer.kind != physics::RelaxerKind::Global)
        say("tissue",
            "[tissue] moves vessels, which only the relaxer \"global\" knows; expected [tissue] rigid = true "
            "with another one");
    if (s.tip_error && s.relaxer.kind != physics::RelaxerKind::Global)
        say("chain.tip_error_mm",
            "only the relaxer \"global\" knows how far its tip is from that of infinitely short segments; "
            "expected tip_error_mm with [relaxer] kind = \"global\"");
    if (s.tip_error && s.adaptive)
        say("chain.tip_error_mm",
            "expected either adaptive = true, segments by the curve, or tip_error_mm, by the tip's error");
    if (s.tip_error && !(std::isfinite(*s.tip_error) && *s.tip_error > 0))
        say("chain.tip_error_mm", "expected an error of the tip above 0 mm");
    if (s.wall_model == WallModel::Analytic && !s.tube) {
        say("wall.model", "an anatomy has no analytic wall; expected auto, distance-field, mesh");
    }
    if (s.target.name.empty() == !s.target.centre) {
        say("target", "[target] takes either 'name' or 'centre_mm'; expected one of them");
    }
    if (s.tube) {
        if (s.tube->scene.empty() == s.tube->path.empty()) {
            say("tube", "[tube] takes either 'scene' or 'path'; expected one of them");
        }
        // A path of one long helix after the other asked for gigabytes.
        const double length = anatomy::length(s.tube->path);
        if (length > longest_tube)
            say("tube.path", fmt::format("{:.0f} mm in all; expected at most {:.0f}", length, longest_tube));
        else if (2 * s.tube->around * length / s.tube->step > most_tube_triangles)
            say("tube.step_mm",
                fmt::format("{:.1f} million triangles would follow; expected at most {:.0f} million: a "
                            "larger step_mm or fewer around",
                            2e-6 * s.tube->around * length / s.tube->step, 1e-6 * most_tube_triangles));
        for (const PlacedDevice& placed : s.devices)
            if (placed.starts_inside() && !physics::enters(placed.device.outer_diameter, s.tube->radius))
                say("tube.radius_mm",
                    fmt::format("a {} of {:g} mm does not fit a tube of radius {:g} mm", placed.name(),
                                placed.device.outer_diameter, s.tube->radius));
    }
    return found;
}

double Scenario::thickest_radius() const {
    double most = 0;
    for (const PlacedDevice& placed : devices) most = std::max(most, 0.5 * placed.device.widest());
    return most;
}

double Scenario::usual_sheath() const {
    constexpr double least = 4;  // F
    return std::max(least, std::ceil(2 * thickest_radius() / french - 1e-9)) * french;
}

namespace {

anatomy::Anatomy vessels_of(const Scenario& s, const anatomy::ModelCache& cache) {
    if (!s.tube) {
        try {
            return s.vessels ? anatomy::generated_anatomy(*s.vessels, cache)
                             : anatomy::load_anatomy(s.anatomy);
        } catch (const io::InputError& error) {
            const io::TextPlace place = s.place("anatomy");
            throw io::InputError(place.file.empty() ? error.what()
                                                    : fmt::format("{}\n  (asked for by {})", error.what(),
                                                                  io::located(place, "anatomy")));
        }
    }
    if (s.tube->scene.empty()) {
        return anatomy::tube_anatomy(s.name, anatomy::draw(s.tube->path), s.tube->radius, s.tube->around,
                                     s.tube->step);
    }
    const anatomy::Scene* scene = anatomy::find_scene(s.tube->scene);
    if (!scene)
        throw io::InputError(io::located(s.place("tube.scene"), "unknown scene '" + s.tube->scene + "'"));
    return anatomy::tube_anatomy(s.tube->scene, anatomy::draw(scene->path), s.tube->radius, s.tube->around,
                                 s.tube->step);
}

}  // namespace

anatomy::Anatomy anatomy_of(const Scenario& s, const anatomy::ModelCache& cache) {
    anatomy::Anatomy vessels = vessels_of(s, cache);
    if (const std::optional<int> entry = anatomy::find_end(vessels, s.entry.end)) {
        geometry::OpenEnd& opening = vessels.ends[*entry].opening;
        opening.goes_on = geometry::Continuation::Sheath;
        opening.bore = 0.5 * (s.entry.sheath > 0 ? s.entry.sheath : s.usual_sheath());
        opening.length = s.entry.sheath_length;
    }
    anatomy::close_blocked_ends(vessels, anatomy::blocked_ends(vessels));
    return vessels;
}

std::vector<std::filesystem::path> inputs_of(const Scenario& s) {
    std::vector<std::filesystem::path> all = s.files;
    for (const std::filesystem::path& file : patient::inputs_of(s.patient_files)) all.push_back(file);
    if (!s.catalogue.empty())
        for (const std::filesystem::path& file : device_files(s.catalogue)) all.push_back(file);
    if (s.anatomy.empty()) return all;
    all.push_back(s.anatomy);
    if (const auto mesh = anatomy::mesh_named_by(s.anatomy)) all.push_back(*mesh);
    return all;
}

void require_no_input(const std::vector<io::Output>& outputs, const Scenario& s,
                      std::vector<std::filesystem::path> more) {
    const std::vector<std::filesystem::path> inputs = inputs_of(s);
    more.insert(more.end(), inputs.begin(), inputs.end());
    io::require_distinct(outputs, more);
}

std::vector<std::filesystem::path> shipped_scenarios(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
        if (entry.path().extension() == ".toml" && entry.path().filename() != benchmark_file)
            files.push_back(entry.path());
    }
    std::ranges::sort(files);
    return files;
}

void TissueChoice::state(geometry::StateStream& s) {
    const auto values = [&](Values& of) {
        double modulus = of.modulus.value_or(-1), wall = of.wall.value_or(-1);
        s(of.vessel, modulus, wall);
    };
    int moves = rigid ? *rigid : -1;
    s(moves);
    values(all);
    for (Values& of : vessels) values(of);
}

}  // namespace scenario

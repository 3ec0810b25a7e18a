#include "engine/scenario/scenario.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <string_view>

#include "engine/anatomy/grow/generate_run.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/script/command.h"

namespace scenario {
namespace {

constexpr double longest_tube = 5000;  // [mm]
constexpr double most_tube_triangles = 2e6;

}  // namespace

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
        say("", "either 'anatomy', a file, or [anatomy], to be grown, or [tube] is accepted, one of them");
    }
    for (const std::string& text : physics::problems(s.guidewire)) say("guidewire", "[guidewire] " + text);
    for (const std::string& text : physics::problems(s.relaxer)) say("relaxer", "[relaxer] " + text);
    for (const std::string& text : render::problems(s.c_arm)) say("c_arm", "[c_arm] " + text);
    if (s.friction() > physics::WireLimits::friction) {
        say("wall.friction",
            fmt::format(
                "a wire of friction {:g} on a wall that scales it by {:g}; up to {:g} in all is accepted",
                s.guidewire.friction, s.wall_friction, physics::WireLimits::friction));
    }
    if (s.relaxer.kind != physics::RelaxerKind::Global) {
        if (s.friction() > 0)
            say("relaxer.kind",
                "the paper's relaxers know no friction; kind = \"global\", or a wire of friction = 0, is "
                "accepted");
        if (s.guidewire.torsional_rigidity > 0)
            say("relaxer.kind",
                "the paper's relaxers know no torsion; kind = \"global\", or a wire of "
                "torsional_rigidity_N_mm2 = 0, "
                "is accepted");
    }
    if (s.catheter) {
        const Device& device = s.catheter->device;
        if (s.relaxer.kind != physics::RelaxerKind::Global)
            say("relaxer.kind",
                "the paper's relaxers know no catheter; kind = \"global\" is accepted with one");
        if (s.torsion == TorsionModel::Segments)
            say("guidewire.torsion",
                "with a catheter each shaft winds up as a whole; \"compliant\" or \"auto\" is accepted");
        if (s.guidewire.diameter >= device.inner_diameter)
            say("guidewire.diameter_mm",
                fmt::format("a wire of {:g} mm does not fit a catheter's lumen of {:g} mm; a thinner wire is "
                            "accepted",
                            s.guidewire.diameter, device.inner_diameter));
        if (s.catheter->inserted > device.length)
            say("catheter.inserted_mm",
                fmt::format("a catheter of {:g} mm cannot be in by {:g} mm; up to its length is accepted",
                            device.length, s.catheter->inserted));
        if (s.adaptive)
            say("guidewire.adaptive",
                "adaptive segments follow one device; adaptive = false is accepted with a catheter");
        for (const std::string& text : physics::problems(device)) say("catheter", text);
    } else if (s.target.by_catheter) {
        say("target.device", "there is no [catheter]; \"wire\" is accepted without one");
    }
    if (s.entry.inserted > s.wire_length) {
        say("entry.inserted_mm",
            fmt::format("a wire of {} mm cannot be in by {} mm; up to its length is accepted", s.wire_length,
                        s.entry.inserted));
    }
    if (s.imaging.pulse_rate && *s.imaging.pulse_rate > s.frame_rate)
        say("imaging.pulse_rate_hz", script::too_many_pulses(*s.imaging.pulse_rate, s.frame_rate));
    if (s.motion.moves() && !s.imaging.patient) {
        say("motion",
            "[motion] moves vessels before a body that stands still; [imaging] patient = true is "
            "accepted with it");
    }
    if (s.wall_model == WallModel::Analytic && !s.tube) {
        say("wall.model", "an anatomy has no analytic wall; auto, distance-field, mesh are accepted");
    }
    if (s.target.name.empty() == !s.target.centre) {
        say("target", "[target] takes either 'name' or 'centre_mm', one of them");
    }
    if (s.tube) {
        if (s.tube->scene.empty() == s.tube->path.empty()) {
            say("tube", "[tube] takes either 'scene' or 'path', one of them");
        }
        // A path of one long helix after the other asked for gigabytes.
        const double length = anatomy::length(s.tube->path);
        if (length > longest_tube)
            say("tube.path",
                fmt::format("{:.0f} mm in all; up to {:.0f} are accepted", length, longest_tube));
        else if (2 * s.tube->around * length / s.tube->step > most_tube_triangles)
            say("tube.step_mm",
                fmt::format(
                    "{:.1f} million triangles would follow; up to {:.0f} million are accepted: a larger "
                    "step_mm or fewer around",
                    2e-6 * s.tube->around * length / s.tube->step, 1e-6 * most_tube_triangles));
        if (!physics::enters(s.guidewire.diameter, s.tube->radius)) {
            say("tube.radius_mm", fmt::format("a wire of {} mm does not fit a tube of radius {} mm",
                                              s.guidewire.diameter, s.tube->radius));
        }
    }
    return found;
}

double Scenario::thickest_radius() const {
    return 0.5 * std::max(guidewire.diameter, catheter ? catheter->device.outer_diameter : 0.0);
}

physics::DeviceSpec Scenario::wire_device() const {
    physics::DeviceSpec spec;
    spec.outer_diameter = guidewire.diameter;
    spec.shaft_rigidity = guidewire.shaft_rigidity;
    spec.tip_rigidity = guidewire.tip_rigidity;
    spec.tip_length = guidewire.tip_length;
    spec.transition_length = guidewire.transition_length;
    spec.torsional_rigidity = guidewire.torsional_rigidity;
    spec.friction = friction();
    spec.buckling_force = guidewire.buckling_force;
    spec.length = wire_length;
    if (guidewire.curved_length > 0 && guidewire.curved_angle != 0)
        spec.shape = {{guidewire.curved_length, guidewire.curved_angle, 0}};
    return spec;
}

anatomy::Anatomy anatomy_of(const Scenario& s, const anatomy::ModelCache& cache) {
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

std::vector<std::filesystem::path> inputs_of(const Scenario& s) {
    std::vector<std::filesystem::path> all = s.files;
    for (const std::filesystem::path& file : patient::inputs_of(s.patient_files)) all.push_back(file);
    if (!s.devices.empty())
        for (const std::filesystem::path& file : device_files(s.devices)) all.push_back(file);
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
        if (entry.path().extension() == ".toml") files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

std::filesystem::path find_scenario(const std::string& path_or_name, const std::filesystem::path& folder) {
    std::error_code error;
    io::require_no_device(path_or_name);
    if (std::filesystem::is_regular_file(path_or_name, error)) return path_or_name;
    std::vector<std::string> names;
    for (const std::filesystem::path& file : shipped_scenarios(folder)) {
        names.push_back(file.stem().string());
        if (names.back() == path_or_name) return file;
    }
    const std::vector<std::string_view> words(names.begin(), names.end());
    throw io::InputError(fmt::format("{}: no such scenario{}; a .toml file or one that ships is accepted: {}",
                                     path_or_name, io::suggestion(path_or_name, words), io::joined(names)));
}

}  // namespace scenario

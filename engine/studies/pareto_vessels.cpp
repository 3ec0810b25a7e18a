#include "engine/studies/pareto_vessels.h"

#include <fmt/format.h>

#include "engine/anatomy/grow/generate_run.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "engine/anatomy/lumen_wall.h"
#include "engine/anatomy/scenes.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

std::shared_ptr<const rivals::Tube> rivals_tube(const anatomy::Scene& scene) {
    std::vector<rivals::Piece> pieces;
    for (const anatomy::PenMove& move : scene.path) {
        if (const auto* run = std::get_if<anatomy::Run>(&move)) {
            pieces.push_back({run->length, 0, geometry::Vec3::UnitZ()});
            continue;
        }
        const auto& arc = std::get<anatomy::Arc>(move);
        pieces.push_back({arc.radius * std::abs(arc.angle), arc.angle, arc.axis});
    }
    return std::make_shared<rivals::Tube>(pieces, scene.radius);
}

/// The tube as about 50 000 triangles.
ParetoVessel mesh_of(const char* name, const anatomy::ModelCache& cache) {
    ParetoVessel v = scene_vessel(name, false);
    const anatomy::Scene& scene = *anatomy::find_scene(name);
    const anatomy::Anatomy tube = anatomy::tube_anatomy(v.name, v.path, scene.radius, 64, 0.1 * scene.radius);
    v.wall = anatomy::cached_distance_field(tube, scene.wall_stiffness, 0.0, cache);
    v.name += " mesh";
    v.tube.reset();
    return v;
}

/// From the left groin into the aorta, with a floppy-tipped wire that is straight when unloaded.
ParetoVessel iliac(const StudyOptions& options) {
    const anatomy::Anatomy anatomy =
        anatomy::generated_anatomy(anatomy::vessel_preset("iliac-renal"), options.cache);
    ParetoVessel v;
    v.name = "iliac mesh";
    v.path = anatomy::path_from(anatomy, *anatomy::find_end(anatomy, "aorta+LCIA+LEIA+LCFA.out")).points;
    v.spec.curved_length = v.spec.curved_angle = 0;
    v.segments = 165;
    v.stiffness = 5;
    v.wall = anatomy::cached_distance_field(anatomy, v.stiffness, 0.5 * v.spec.diameter, options.cache);
    return v;
}

}  // namespace

std::string ParetoVessel::text() const {
    const std::string tip =
        spec.tip_rigidity == spec.shaft_rigidity ? "" : fmt::format(" (tip {:g})", spec.tip_rigidity);
    return fmt::format("{}: N = {}, λ = {:g} mm, EI = {:g} N·mm²{}, k = {:g} N/mm", name, segments,
                       spec.segment_length, spec.shaft_rigidity, tip, stiffness);
}

physics::Chain ParetoVessel::wire(int n) const {
    physics::Chain wire = wire_along(spec, path, n);
    const auto contacts = physics::all_contacts(wire, *wall);
    for (std::size_t i = 0; i < contacts.size(); ++i) wire.stations[i] = contacts[i].station;
    return wire;
}

double round_wire_axial(double bending) {
    constexpr double diameter = 0.014 * 25.4;
    return 16 * bending / (diameter * diameter);
}

ParetoVessel scene_vessel(const char* name, bool quick) {
    const anatomy::Scene& scene = *anatomy::find_scene(name);
    ParetoVessel v;
    v.name = name;
    v.path = anatomy::draw(scene.path);
    v.spec = PlainWire::uniform(scene.rigidity, scene.segment_length);
    v.segments = quick ? 60 : scene.segments;
    v.stiffness = scene.wall_stiffness;
    v.wall = std::make_shared<physics::TubeWall>(v.path, scene.radius, v.stiffness);
    v.tube = rivals_tube(scene);
    v.rod.segment_length = scene.segment_length;
    v.rod.bending = scene.rigidity;
    v.rod.axial = round_wire_axial(scene.rigidity);
    v.rod.wall_stiffness = scene.wall_stiffness;
    return v;
}

std::vector<ParetoVessel> pareto_tubes(bool quick) {
    if (quick) return {scene_vessel("sinuous", true)};
    std::vector<ParetoVessel> list;
    for (const char* name : {"sinuous", "spatial", "hairpin", "stiffwall"})
        list.push_back(scene_vessel(name, false));
    return list;
}

std::vector<ParetoVessel> pareto_meshes(const StudyOptions& options) {
    if (options.quick) return {};
    return {mesh_of("spatial", options.cache), iliac(options)};
}

}  // namespace studies

#include "engine/exercise/imaging.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <numbers>
#include <random>

#include "engine/anatomy/organs.h"
#include "engine/exercise/body.h"
#include "engine/exercise/distal_trees.h"
#include "engine/exercise/room_in_beam.h"
#include "engine/exercise/treatment_image.h"
#include "engine/io/error.h"
#include "engine/io/text.h"
#include "engine/patient/ct_patient.h"
#include "engine/scenario/breathing.h"
#include "physics/geometry/checksum.h"
#include "physics/geometry/mapped_file.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/mesh_topology.h"
#include "render/patient/organ_motion.h"
#include "render/patient/solids.h"
#include "render/xray/path_length.h"

namespace exercise {
namespace {

/// Organs beside the vessels move as far down as these do, others in proportion
/// (render/patient/organ_motion.h): the diaphragm by 25 mm at most. They beat where the vessels do.
void move_with(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy,
               const geometry::Vec3& origin, std::vector<render::TissueLayer>& layers) {
    const scenario::VesselMotion& motion = scenario.motion;
    constexpr double quiet = 14, deepest = 25;  // [mm]
    if (!motion.moves()) return;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const geometry::Vec3& p : anatomy.lumen.vertices) {
        low = std::min(low, p.z());
        high = std::max(high, p.z());
    }
    const double fraction = render::breathing_fraction(0.5 * (low + high) - origin.z()),
                 reach = motion.breathing_reach.norm();
    const double breath = reach == 0 ? 0 : fraction < 0.2 ? quiet : std::min(deepest, reach / fraction);
    std::function<geometry::Vec3(const geometry::Vec3&)> systole;
    if (!motion.heart_reach.isZero())
        systole = [field = scenario::MotionField(motion, blood::blood_flow(anatomy, scenario.blood))](
                      const geometry::Vec3& x) { return field.systole_at(x); };
    render::move_organs(layers, origin, breath, systole);
}

render::TissueLayer lumen_layer(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy) {
    render::TissueLayer lumen;
    lumen.name = "lumen";
    lumen.material = render::Material::SoftTissue;
    lumen.inside = scenario.imaging.patient ? render::Material::SoftTissue : render::Material::Air;
    lumen.mesh = anatomy::closed_lumen(anatomy);
    lumen.takes_contrast = true;
    return lumen;
}

/// The body that the scenario's vessels have around them; null in air and in a CT.
std::shared_ptr<const Body> synthetic_body(const scenario::Scenario& scenario,
                                           const anatomy::Anatomy& anatomy,
                                           const anatomy::ModelCache& cache) {
    if (!scenario.imaging.patient || !scenario.patient_files.ct.empty()) return nullptr;
    return body_around(anatomy, cache);
}

/// What is in the beam besides the synthetic body.
void add_others(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy,
                std::vector<render::TissueLayer>& layers) {
    if (scenario.imaging.patient)
        for (render::TissueLayer& layer : patient::mesh_layers(scenario.patient_files))
            layers.push_back(std::move(layer));
    for (const anatomy::CalciumDeposit& deposit : anatomy.calcium) {
        render::TissueLayer calcium;
        calcium.name = "calcium";
        calcium.material = render::Material::CorticalBone;
        calcium.inside = scenario.imaging.patient ? render::Material::SoftTissue : render::Material::Air;
        constexpr int around = 8;
        calcium.mesh =
            render::tube(deposit.points, geometry::Vec3(0.3, 0.5, 0.8), deposit.radii, deposit.radii, around);
        layers.push_back(std::move(calcium));
    }
    layers.push_back(lumen_layer(scenario, anatomy));
}

std::vector<render::TissueLayer> layers_with(const Body* body, const scenario::Scenario& scenario,
                                             const anatomy::Anatomy& anatomy) {
    std::vector<render::TissueLayer> layers;
    if (body) {
        layers = body->layers;
        move_with(scenario, anatomy, body->origin, layers);
    }
    add_others(scenario, anatomy, layers);
    return layers;
}

constexpr double cubic_mm_in_ml = 1000.0;

/// Mean concentration in the blood along joints, from every fifth [mg/ml].
double around(const blood::ContrastFlow& contrast, std::span<const geometry::Vec3> joints) {
    constexpr std::size_t stride = 5;
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < joints.size(); i += stride, ++count)
        sum += contrast.iodine()[contrast.blood().nearest(joints[i])];
    return sum / std::max(count, 1);
}

constexpr int bore_parts = 100;  // of a length

/// About a device, where contrast has been injected.
render::DeviceIodine iodine_of(const Simulation& simulation, int device, const geometry::Polyline& joints) {
    if (joints.empty()) return {};
    render::DeviceIodine iodine;
    iodine.around = around(simulation.contrast(), joints);
    const scenario::Device& outer = simulation.devices()[static_cast<std::size_t>(device)].device;
    iodine.length = outer.length;
    iodine.bore = simulation.contrast().in_line(device, bore_parts);
    if (device == 0 || (iodine.bore.empty() && iodine.around == 0)) return iodine;
    iodine.bore.resize(bore_parts, 0.0f);
    // Where another device lies in the bore, less is left to contrast; that one displaces what is around.
    const auto [inner, inside] = simulation.bore_of(device);
    const double free = 1 - std::min(1.0, geometry::pow(inner / outer.inner_diameter, 2));
    for (int k = 0; k < bore_parts; ++k) {
        if ((k + 0.5) / bore_parts * outer.length > inside) break;
        float& there = iodine.bore[static_cast<std::size_t>(k)];
        there = static_cast<float>(free * there + (1 - free) * iodine.around);
    }
    return iodine;
}

render::DeviceIodine iodine_of(const Simulation& simulation, const Simulation::Standing& standing) {
    render::DeviceIodine iodine;
    iodine.length = standing.tube.spec.length;
    iodine.bore = simulation.contrast().in_line(standing.line, bore_parts);
    return iodine;
}

/// The first with that name, from a layer on; -1 = none.
int layer_named(const std::vector<render::TissueLayer>& layers, const std::string& name, int from = 0) {
    const auto found = std::find_if(layers.begin() + from, layers.end(),
                                    [&](const render::TissueLayer& layer) { return layer.name == name; });
    return found == layers.end() ? -1 : static_cast<int>(found - layers.begin());
}

geometry::Vec3 middle_of(const render::TissueLayer& layer) {
    geometry::Vec3 middle = geometry::Vec3::Zero();
    for (const geometry::Vec3& v : layer.mesh.vertices) middle += v;
    return middle / static_cast<double>(std::max<std::size_t>(layer.mesh.vertices.size(), 1));
}

render::GreyCurve curve_of(script::ImagingMode mode) {
    return mode == script::ImagingMode::Cine ? render::GreyCurve::Cine : render::GreyCurve::Fluoroscopy;
}

/// Before the limit [nGy].
double wanted_dose(const scenario::Scenario& scenario, const render::CArm& arm, script::ImagingMode mode) {
    const double magnified = std::max(1.0, scenario.c_arm.detector_width / arm.detector_width);
    const scenario::Imaging& imaging = scenario.imaging;
    return magnified * (mode == script::ImagingMode::Dsa    ? imaging.acquisition_dose
                        : mode == script::ImagingMode::Cine ? imaging.cine_dose
                                                            : imaging.detector_dose);
}

/// Side of the focal spot [mm]: a large one bears the power of an acquisition, and a magnified field gets the
/// next smaller one (nominal sizes of a cath lab's tube, IEC 60336).
double focal_spot(const render::CArm& arm, script::ImagingMode mode) {
    constexpr double magnified = 165;  // width of the field [mm]
    const bool small = arm.detector_width <= magnified;
    return script::acquires(mode) ? (small ? 0.6 : 1.0) : (small ? 0.3 : 0.6);
}

/// Along the vessel at a hole, perpendicular to the way out; unit.
geometry::Vec3 beside_vessel(const blood::BloodFlow& blood, const blood::Hole& hole) {
    const blood::FlowCell& cell = blood.cells[static_cast<std::size_t>(hole.cell)];
    geometry::Vec3 along, other;
    geometry::tangent_basis(hole.outward, along, other);
    if (cell.upstream < 0) return along;
    const geometry::Vec3 axis =
        (cell.centre - blood.cells[static_cast<std::size_t>(cell.upstream)].centre).normalized();
    const geometry::Vec3 beside = axis - axis.dot(hole.outward) * hole.outward;
    return beside.norm() > 0.1 ? beside.normalized() : along;
}

/// The CT of the scenario's patient; none without.
std::vector<render::DensityVolume> volumes_of(const scenario::Scenario& scenario,
                                              const geometry::TriangleMesh& lumen,
                                              const anatomy::ModelCache& cache) {
    std::vector<render::DensityVolume> volumes;
    if (scenario.imaging.patient && !scenario.patient_files.ct.empty())
        volumes.push_back(patient::ct_volume(scenario.patient_files, lumen, cache));
    return volumes;
}

/// What a broken mesh of the anatomy is to a user.
template <class Make>
auto with_closed_meshes(const anatomy::Anatomy& anatomy, const Make& make) {
    try {
        return make();
    } catch (const render::OpenMeshError& error) {
        throw io::InputError(anatomy.name + ": a closed mesh is needed for imaging: " + error.what());
    } catch (const render::OverlappingMeshError& error) {
        throw io::InputError(anatomy.name +
                             ": a mesh that encloses each place once is needed for imaging: " + error.what());
    }
}

render::LumenContrast lumen_contrast(const geometry::TriangleMesh& lumen,
                                     const blood::ContrastFlow& contrast) {
    return {lumen,
            {contrast.nodes().begin(), contrast.nodes().end()},
            {contrast.radii().begin(), contrast.radii().end()}};
}

}  // namespace

std::vector<std::string> patient_notes(const scenario::Scenario& scenario) {
    return patient::mesh_notes(scenario.patient_files);
}

std::vector<render::TissueLayer> tissue_layers(const scenario::Scenario& scenario,
                                               const anatomy::Anatomy& anatomy,
                                               const anatomy::ModelCache& cache) {
    return layers_with(synthetic_body(scenario, anatomy, cache).get(), scenario, anatomy);
}

double BlushingOrgan::iodine(std::span<const blood::Blush> blush) const {
    double sum = 0;
    for (std::size_t k = 0; k < outlets.size(); ++k) {
        const blood::Blush& behind = blush[static_cast<std::size_t>(outlets[k])];
        const double there = part == Part::Whole   ? behind.iodine
                             : part == Part::Inner ? behind.inner
                                                   : behind.iodine - behind.inner;
        sum += fractions[k] * there;
    }
    return sum;
}

std::vector<int> supplied_layers(const std::vector<render::TissueLayer>& layers,
                                 const blood::Outlet& outlet) {
    // It leaves a carotid artery, but supplies the eye, which is not drawn.
    if (outlet.branch.ends_with("ophthalmic")) return {};
    int nearest = -1;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t layer = 0; layer < layers.size(); ++layer) {
        if (!layers[layer].name.ends_with(outlet.organ)) continue;
        const double away = (middle_of(layers[layer]) - outlet.place).norm();
        if (away >= least) continue;
        least = away;
        nearest = static_cast<int>(layer);
    }
    if (nearest < 0) return {};
    const std::string& whole = layers[nearest].name;
    std::vector<int> supplied;
    const bool on_left = outlet.place.x() > middle_of(layers[nearest]).x();
    for (const std::string& territory : anatomy::brain_territories(outlet.branch, on_left)) {
        if (const int layer = layer_named(layers, whole + ", " + territory); layer >= 0)
            supplied.push_back(layer);
    }
    if (supplied.empty()) supplied.push_back(nearest);
    return supplied;
}

std::vector<BlushingOrgan> blushing_organs(const std::vector<render::TissueLayer>& layers,
                                           std::span<const blood::Outlet> outlets) {
    using Part = BlushingOrgan::Part;
    std::vector<BlushingOrgan> organs;
    const auto volume_of = [&](int layer) {
        return geometry::signed_volume(layers[layer].mesh) / cubic_mm_in_ml;
    };
    const auto supply = [&](int layer, Part part, int outlet, double fraction) {
        auto known = std::ranges::find_if(
            organs, [&](const BlushingOrgan& organ) { return organ.layer == layer && organ.part == part; });
        if (known == organs.end()) {
            organs.push_back({layer, volume_of(layer), {}, {}, part});
            known = organs.end() - 1;
        }
        known->outlets.push_back(outlet);
        known->fractions.push_back(fraction);
    };
    for (std::size_t k = 0; k < outlets.size(); ++k) {
        const std::vector<int> supplied = supplied_layers(layers, outlets[k]);
        double volume = 0;
        for (const int layer : supplied) volume += volume_of(layer);
        for (const int layer : supplied) {
            const int outlet = static_cast<int>(k),
                      // A body lists an organ before its parts: one of a later body has none here.
                outer = layer_named(layers, layers[layer].name + " cortex", layer),
                      inner = layer_named(layers, layers[layer].name + " medulla", layer);
            const double fraction = supplied.size() == 1 ? 1.0 : volume_of(layer) / volume;
            if (outer >= 0 && inner >= 0) {
                supply(outer, Part::Outer, outlet, fraction);
                supply(inner, Part::Inner, outlet, fraction);
            } else {
                supply(layer, Part::Whole, outlet, fraction);
            }
        }
    }
    return organs;
}

double detector_dose(const scenario::Scenario& scenario, const render::CArm& arm, script::ImagingMode mode) {
    return std::min(wanted_dose(scenario, arm, mode), render::largest_detector_dose);
}

bool dose_is_limited(const scenario::Scenario& scenario, const render::CArm& arm, script::ImagingMode mode) {
    return wanted_dose(scenario, arm, mode) > render::largest_detector_dose;
}

render::Exposure metered_exposure(const Simulation& simulation) {
    const scenario::Scenario& scenario = simulation.scenario();
    render::Exposure exposure;
    exposure.detector_dose = detector_dose(scenario, simulation.console().arm(), simulation.console().mode());
    exposure.kvp = scenario.imaging.kvp;
    exposure.curve = curve_of(simulation.console().mode());
    exposure.focal_spot = focal_spot(simulation.console().arm(), simulation.console().mode());
    return exposure;
}

std::vector<render::IodineCloud> clouds_of(const blood::BloodFlow& blood, const blood::Hole& hole) {
    constexpr double fraction_of_tissue = 0.5;  // of a place, that blood takes in it (estimate) [-]
    constexpr double at_hole = 0.05;            // of the iodine, in the jet (estimate) [-]
    constexpr int lobes = 20, tracks = 4;       // the latter along the vessel
    if (!(hole.iodine > 0)) return {};
    const double pool = geometry::cbrt(3 * cubic_mm_in_ml * hole.blood /
                                       (4 * std::numbers::pi * fraction_of_tissue)),
                 radius = std::max(pool, hole.diameter);
    const geometry::Vec3 u = beside_vessel(blood, hole), v = hole.outward.cross(u);
    std::vector<render::IodineCloud> clouds;
    double weights = 0;
    const auto add = [&](double along, double aside, double out, double spread, double weight) {
        clouds.push_back(
            {hole.place + radius * (along * u + aside * v + out * hole.outward), spread * radius, weight});
        weights += weight;
    };
    // Every hole has lobes of its own, which stay as they are while the pool grows. In radii of the pool.
    geometry::Hash of_place;
    of_place.add(hole.place.data(), sizeof hole.place);
    std::mt19937 random(static_cast<std::uint32_t>(of_place.value()));
    const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
    constexpr double golden = 2.399963;  // of a turn, by which points on a ball lie evenly [rad]
    for (int k = 0; k < lobes; ++k) {
        const double height = 1 - 2 * (k + 0.5) / lobes, turn = golden * k + unit(),
                     away = geometry::cbrt(unit()), flat = away * std::sqrt(1 - height * height),
                     spread = 0.2 + 0.2 * unit();
        add(1.2 * away * height, 0.9 * flat * geometry::cos(turn), 0.75 + 0.7 * flat * geometry::sin(turn),
            spread, (0.5 + unit()) * geometry::pow(spread, 2.5));
    }
    const double in_lobes = weights;
    for (int k = 0; k < tracks; ++k)
        add((k % 2 == 0 ? 1 : -1) * (0.7 + 0.8 * unit()), 0.5 * unit() - 0.25, 0.1 + 0.2 * unit(),
            0.16 + 0.1 * unit(), 0.015 * in_lobes);
    for (render::IodineCloud& cloud : clouds) cloud.iodine *= (1 - at_hole) * hole.iodine / weights;
    clouds.push_back({hole.place + 0.25 * radius * hole.outward, 0.19 * radius, at_hole * hole.iodine});
    return clouds;
}

std::vector<render::IodineCloud> cloud_of(const anatomy::Anatomy& anatomy, const Simulation::Jet& jet) {
    constexpr double decay = 5, spread = 0.1;  // Pope 2000, Table 5.1 and Eq. 5.6 [-]
    constexpr double blunt = 0.3;              // of the bore, at the orifice [-]
    constexpr double farthest = 60;            // [mm]
    std::vector<render::IodineCloud> clouds;
    if (!(jet.bore > 0)) return clouds;
    double step = 0;
    for (double gone = 0.5 * jet.bore; gone < farthest; gone += step) {
        const geometry::Vec3 at = jet.from.at + gone * jet.from.along;
        const double width = std::max(blunt * jet.bore, spread * gone);
        step = width;
        if (anatomy::nearest_place(anatomy, at).distance > -1.5 * width) break;
        const double concentration = jet.out.iodine * std::min(1.0, decay * jet.bore / gone);  // [mg/ml]
        clouds.push_back(
            {at, width, 2 * std::numbers::pi * width * width * step * concentration / cubic_mm_in_ml});
    }
    return clouds;
}

void set_mode(Pulse& pulse, const scenario::Scenario& scenario, script::ImagingMode mode) {
    pulse.mode = mode;
    pulse.exposure.focal_spot = focal_spot(pulse.arm, mode);
    pulse.exposure.detector_dose = detector_dose(scenario, pulse.arm, mode);
    pulse.exposure.curve = curve_of(mode);
}

Pulse pulse_of(const Simulation& simulation, const FrameTime& time, std::span<const BlushingOrgan> organs) {
    const scenario::Scenario& scenario = simulation.scenario();
    Pulse pulse;
    pulse.time = time;
    pulse.arm = simulation.console().arm();
    const bool flows = simulation.contrast().injected() > 0;
    for (int k = 0; const scenario::PlacedDevice& placed : simulation.devices()) {
        pulse.devices.push_back({placed.role, simulation.carried_path_of(placed.role), placed.device.look});
        if (flows) pulse.devices.back().iodine = iodine_of(simulation, k, pulse.devices.back().joints);
        ++k;
    }
    show_treatment(simulation, pulse);
    for (const Simulation::Standing& standing : simulation.standing()) {
        pulse.tubes.push_back({standing.tube.joints, standing.tube.look});
        for (geometry::Vec3& joint : pulse.tubes.back().joints)
            joint = simulation.place_now(joint) - simulation.vessel_shift();
        if (flows) pulse.tubes.back().iodine = iodine_of(simulation, standing);
    }
    pulse.tip_of_device = *scenario.index_of(scenario.target.device);
    pulse.mode = simulation.console().mode();
    render::Exposure& exposure = pulse.exposure = metered_exposure(simulation);
    exposure.frame = static_cast<std::uint64_t>(time.attempt);
    exposure.seed = scenario.seed;
    exposure.iodine = simulation.iodine();
    exposure.vessel_shift = simulation.vessel_shift();
    if (!scenario.motion.heart_reach.isZero()) {
        constexpr double moment = 5e-3;  // [s]
        const auto shift = [&](double since) {
            return scenario.motion.with_breath(std::max(0.0, simulation.time() + since), simulation.breath());
        };
        exposure.vessel_velocity = (shift(moment) - shift(-moment)) / (2 * moment);
    }
    Simulation::VesselMoves moves = simulation.vessel_moves();
    for (const blood::Hole& hole : simulation.contrast().holes())
        for (render::IodineCloud& cloud : clouds_of(simulation.contrast().blood(), hole)) {
            cloud.middle += exposure.vessel_shift;
            if (!moves.of_nodes.empty())
                cloud.middle += moves.of_nodes[static_cast<std::size_t>(hole.cell)].cast<double>();
            exposure.clouds.push_back(cloud);
        }
    exposure.vessel_moves = std::move(moves.of_nodes);
    exposure.distal_moves = std::move(moves.of_distal);
    exposure.lumen_moves = simulation.narrowed_lumen();
    if (!scenario.motion.breathing_reach.isZero()) exposure.breath = simulation.breath();
    // The bowel does not wait for a breath that is held.
    if (!scenario.motion.breathing_reach.isZero()) exposure.drift = scenario::peristalsis(simulation.time());
    if (!scenario.motion.heart_reach.isZero())
        exposure.beat = scenario::contraction(simulation.time(), scenario.motion.heart_rate);
    const blood::ContrastFlow& contrast = simulation.contrast();
    if (flows) {
        exposure.vessel_iodine = lumen_iodine(contrast);
        exposure.vessel_streams = contrast.streams();
        exposure.distal_iodine = distal_iodine(contrast);
        for (const Simulation::Jet& jet : simulation.jets())
            for (render::IodineCloud& cloud : cloud_of(simulation.anatomy(), jet)) {
                cloud.middle = simulation.place_now(cloud.middle);
                exposure.jets.push_back(cloud);
            }
        for (const BlushingOrgan& organ : organs) {
            exposure.organs.push_back({organ.layer, organ.iodine(contrast.blush()) / organ.volume});
        }
    }
    return pulse;
}

bool has_contrast(const render::Exposure& exposure) {
    const auto some = [](float concentration) { return concentration > 1e-3f; };
    return exposure.iodine > 0 || !exposure.clouds.empty() ||
           std::ranges::any_of(exposure.vessel_iodine, some) ||
           std::ranges::any_of(exposure.distal_iodine, some);
}

void remove_contrast(Pulse& pulse) {
    for (PulsedDevice& device : pulse.devices) {
        device.iodine = {};
        device.filling.clear();
    }
    for (PulsedTube& tube : pulse.tubes) tube.iodine = {};
    render::Exposure& exposure = pulse.exposure;
    exposure.iodine = 0;
    exposure.jets.clear();
    exposure.vessel_iodine.clear();
    exposure.vessel_streams.clear();
    exposure.distal_iodine.clear();
    exposure.organs.clear();
    exposure.clouds.clear();
}

render::ExposureMeter make_meter(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy,
                                 const anatomy::ModelCache& cache) {
    const std::shared_ptr<const Body> body = synthetic_body(scenario, anatomy, cache);
    std::vector<render::TissueLayer> layers = room_in_beam(scenario, body.get());
    add_others(scenario, anatomy, layers);
    std::vector<render::VolumeRayCaster> ray_casters;
    for (render::DensityVolume& volume : volumes_of(scenario, layers.back().mesh, cache))
        ray_casters.emplace_back(std::move(volume));
    render::FluoroscopeConfig config;
    if (!body) return {config, layers, std::move(ray_casters)};
    return {config, layers, std::move(ray_casters), metered(body)};
}

ImagingChain make_imaging(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy,
                          const blood::ContrastFlow& contrast, const anatomy::ModelCache& cache) {
    return with_closed_meshes(anatomy, [&] {
        const std::shared_ptr<const Body> body = synthetic_body(scenario, anatomy, cache);
        std::vector<render::TissueLayer> layers = layers_with(body.get(), scenario, anatomy);
        // Behind the body's, which meters know already.
        std::vector<render::TissueLayer> room = room_in_beam(scenario, body.get());
        if (body)
            layers.insert(layers.begin() + static_cast<std::ptrdiff_t>(body->layers.size()),
                          std::make_move_iterator(room.begin()), std::make_move_iterator(room.end()));
        std::vector<BlushingOrgan> organs = blushing_organs(layers, contrast.blood().outlets);
        for (const BlushingOrgan& organ : organs) layers[organ.layer].perfused = true;
        render::require_closed("lumen", layers.back().mesh);
        layers.back().closed = true;
        render::LumenContrast vessels = lumen_contrast(layers.back().mesh, contrast);
        render::DistalVessels distal(distal_trees(anatomy, contrast.blood(), layers),
                                     distal_nodes(contrast.blood()));
        std::vector<render::DensityVolume> volumes = volumes_of(scenario, layers.back().mesh, cache);
        return ImagingChain{render::Fluoroscope({}, std::move(layers), std::move(vessels), std::move(distal),
                                                std::move(volumes), body ? metered(body) : nullptr),
                            std::move(organs)};
    });
}

namespace {

/// To be raised whenever layers of the same body are seen otherwise, or the layout of a kept view changes.
constexpr std::uint64_t view_version = 1;

/// Covers all that the view depends on; none where it is no still one.
std::optional<std::uint64_t> view_key(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy,
                                      const render::CArm& arm) {
    const patient::PatientFiles& files = scenario.patient_files;
    if (scenario.motion.moves() || !files.ct.empty() || !files.meshes.empty()) return std::nullopt;
    geometry::Hash hash;
    const auto add = [&hash](const auto& list) {
        hash.add(geometry::checksum(std::as_bytes(std::span(list))));
    };
    const scenario::Imaging& imaging = scenario.imaging;
    hash.add(view_version);
    hash.add(imaging.patient ? body_key(anatomy) : 0);
    hash.add(std::uint64_t{imaging.patient} | std::uint64_t{imaging.table} << 1 |
             std::uint64_t{imaging.leads} << 2);
    hash.add(scenario.c_arm.isocentre.z());  // where the table top is
    add(anatomy.lumen.vertices);
    add(anatomy.lumen.triangles);
    for (const anatomy::CalciumDeposit& deposit : anatomy.calcium) {
        add(deposit.points);
        add(deposit.radii);
    }
    hash.add(geometry::state_hash_of(arm));
    return hash.value();
}

/// The place of a view, and the key of what is in it.
struct ViewPlace {
    std::uint64_t key;
    anatomy::CachePlace place;

    ViewPlace(std::uint64_t of, const anatomy::ModelCache& cache)
        : key(of), place(cache, "view-" + io::hash_text(of) + ".bin") {}
    std::optional<render::StillView> view() const {
        const auto file = place.exists() ? geometry::MappedFile::of(place.path()) : nullptr;
        if (!file) return std::nullopt;
        const std::span<const std::byte> state = anatomy::unsealed(key, file->bytes());
        if (state.empty()) return std::nullopt;
        render::StillView view;
        geometry::restore_state(view, state);
        return view;
    }
};

}  // namespace

std::optional<render::StillView> kept_view(const scenario::Scenario& scenario,
                                           const anatomy::Anatomy& anatomy, const render::CArm& arm,
                                           const anatomy::ModelCache& cache) {
    const auto key = view_key(scenario, anatomy, arm);
    if (!key || cache.folder.empty()) return std::nullopt;
    const ViewPlace kept(*key, cache);
    std::optional<render::StillView> view = kept.view();
    if (view) kept.place.used();
    return view;
}

bool keep_view(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy, const render::CArm& arm,
               render::Fluoroscope& fluoroscope, const anatomy::ModelCache& cache) {
    const auto key = view_key(scenario, anatomy, arm);
    if (!key) return false;
    const ViewPlace kept(*key, cache);
    return kept.view() ||
           kept.place.keep_file(anatomy::sealed(*key, geometry::state_of(fluoroscope.still_view(arm))));
}

render::Fluoroscope make_masking(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy,
                                 const blood::ContrastFlow& contrast) {
    return with_closed_meshes(anatomy, [&] {
        std::vector<render::TissueLayer> layers;
        layers.push_back(lumen_layer(scenario, anatomy));
        render::LumenContrast vessels = lumen_contrast(layers.back().mesh, contrast);
        return render::Fluoroscope({}, std::move(layers), std::move(vessels));
    });
}

}  // namespace exercise

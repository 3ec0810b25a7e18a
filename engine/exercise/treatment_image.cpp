#include "engine/exercise/treatment_image.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "render/xray/struts.h"

namespace exercise {
namespace {

using geometry::Polyline;
using geometry::Vec3;

constexpr double line_step = 0.5;      // of what lies along a catheter [mm]
constexpr double least_filling = 0.1;  // of a balloon's radius, beyond its shaft, that is drawn [mm]

/// From one distance from the tip to another, toward the hub; as far as the path goes [mm].
struct AlongPath {
    Polyline points;
    std::vector<double> from_tip;
};
AlongPath along_path(const Polyline& path, double from, double to) {
    AlongPath line;
    double gone = 0, next = from;
    for (std::size_t i = path.size(); i-- > 1 && next <= to;) {
        const Vec3 step = path[i - 1] - path[i];
        const double length = step.norm();
        for (; next <= std::min(to, gone + length) && length > 0; next += line_step) {
            line.points.push_back(path[i] + (next - gone) / length * step);
            line.from_tip.push_back(next);
        }
        gone += length;
    }
    return line;
}

/// A balloon that is folded, or of which the shaft is all that is seen, has none.
std::vector<PulsedTube> filling_of(const Inflation& inflation, const scenario::Device& device,
                                   const Polyline& path, double around) {
    const scenario::Balloon& balloon = *device.balloon;
    const double first = balloon.from_tip - balloon.cone, folded = 0.5 * device.widest(),
                 shaft = 0.5 * device.look.diameter;
    if (inflation.radii.empty() || std::ranges::max(inflation.radii) < folded + least_filling) return {};
    const physics::Bulge shape{first, inflation.radii};
    AlongPath line = along_path(path, std::max(0.0, first), balloon.from_tip + balloon.length + balloon.cone);
    if (line.points.size() < 2) return {};
    PulsedTube filling;
    for (const double s : line.from_tip) {
        const double r = std::max(folded, shape.radius(s));
        // The folded balloon takes room that no contrast has.
        filling.radii.push_back(std::sqrt(r * r - folded * folded + shaft * shaft));
    }
    std::ranges::reverse(line.points);
    std::ranges::reverse(filling.radii);
    filling.joints = std::move(line.points);
    filling.look = device.look;
    filling.look.inner_diameter = filling.look.diameter;
    filling.look.core_diameter = device.look.diameter;
    filling.look.marker_length = 0;
    filling.look.bands.clear();
    filling.iodine = {around, {static_cast<float>(Treatment::iodine_in_balloon)}, 1};
    return {filling};
}

PulsedStent stent_of(const scenario::Stent& stent, std::span<const Vec3> axis,
                     std::span<const double> radii) {
    PulsedStent seen;
    seen.struts = render::struts(axis, radii, stent.crowns, stent.pitch);
    seen.look.diameter = stent.strut;
    seen.look.body = stent.material;
    seen.look.marker_length = 0;
    return seen;
}

/// What has not left its balloon or its sheath.
void add_crimped(const Inflation& inflation, const scenario::Device& device, const Polyline& path,
                 Pulse& pulse) {
    const scenario::Stent& stent = *device.stent;
    if (!stent.law.self_expanding && inflation.deployed) return;
    const double to = stent.from_tip + stent.length / (1 - stent.foreshortening),
                 sheath = 0.5 * device.outer_diameter - stent.strut,
                 radius = (stent.law.self_expanding ? sheath : 0.5 * device.widest()) - 0.5 * stent.strut;
    const AlongPath line = along_path(path, stent.from_tip + inflation.uncovered, to);
    if (line.points.size() < 2 || line.from_tip.back() - line.from_tip.front() < stent.pitch) return;
    pulse.stents.push_back(stent_of(stent, line.points, std::vector<double>(line.points.size(), radius)));
}

}  // namespace

void show_treatment(const Simulation& simulation, Pulse& pulse) {
    const Treatment& treatment = simulation.treatment();
    for (const PlacedStent& stent : treatment.stents()) {
        Polyline axis = simulation.axis_now(stent);
        for (Vec3& place : axis) place -= simulation.vessel_shift();
        std::vector<double> radii;
        for (const PlacedStent::Sample& sample : stent.samples)
            radii.push_back(std::max(stent.spec.strut, sample.place.stent - 0.5 * stent.spec.strut));
        if (axis.size() > 1) pulse.stents.push_back(stent_of(stent.spec, axis, radii));
    }
    const Inflation* const inflation = treatment.inflation();
    if (!inflation) return;
    for (std::size_t k = 0; k < pulse.devices.size(); ++k) {
        PulsedDevice& seen = pulse.devices[k];
        const scenario::Device& device = simulation.devices()[k].device;
        if (seen.role != script::DeviceRole::Balloon || seen.joints.size() < 2) continue;
        if (device.balloon) {
            const scenario::Balloon& balloon = *device.balloon;
            seen.look.bands = {balloon.from_tip, balloon.from_tip + balloon.length};
            seen.filling = filling_of(*inflation, device, seen.joints, seen.iodine.around);
        }
        if (device.stent) add_crimped(*inflation, device, seen.joints, pulse);
    }
}

}  // namespace exercise

#include "engine/exercise/lines.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/exercise/device_rules.h"
#include "physics/geometry/maths.h"

namespace exercise {
namespace {

using geometry::Polyline;
using geometry::Vec3;

constexpr double joints_apart = 3;  // of joints [mm]

render::WireLook look_of(const physics::DeviceSpec& spec, double marker) {
    render::WireLook look;
    look.diameter = spec.outer_diameter;
    look.inner_diameter = spec.inner_diameter;
    look.body = render::Material::BariumPolymer;
    look.marker = render::Material::TungstenPolymer;
    look.marker_fill = 1;
    look.marker_length = marker;
    return look;
}

/// Joints from the hub to the end, of a tube that leaves `end` along `outward` and turns to `then` in a bend
/// of that radius.
Polyline led_out(const Vec3& end, const Vec3& outward, const Vec3& then, double straight, double radius,
                 double length) {
    Polyline joints{end};
    Vec3 along = outward;
    for (double gone = 0; gone < length; gone += joints_apart) {
        if (gone >= straight) {
            const Vec3 axis = along.cross(then);
            const double left = geometry::atan2(axis.norm(), along.dot(then));
            if (left > 1e-6)
                along = geometry::rotation(std::min(left, joints_apart / radius), axis.normalized()) * along;
        }
        joints.push_back(joints.back() + joints_apart * along);
    }
    std::ranges::reverse(joints);
    return joints;
}

/// Moves each point to the mean of those within `reach` of it, as far as both sides have as many.
Polyline smoothed(const Polyline& points, double reach) {
    const int count = static_cast<int>(points.size()), most = static_cast<int>(reach / joints_apart);
    Polyline result = points;
    for (int i = 0; i < count; ++i) {
        const int side = std::min({most, i, count - 1 - i});
        Vec3 sum = Vec3::Zero();
        for (int k = i - side; k <= i + side; ++k) sum += points[static_cast<std::size_t>(k)];
        result[static_cast<std::size_t>(i)] = sum / (2 * side + 1);
    }
    return result;
}

Polyline evenly(const Polyline& points) {
    Polyline even{points.front()};
    double left = joints_apart;
    for (std::size_t i = 1; i < points.size(); ++i) {
        Vec3 from = points[i - 1];
        double length = (points[i] - from).norm();
        while (length >= left && length > 0) {
            from += left / length * (points[i] - from);
            even.push_back(from);
            length = (points[i] - from).norm();
            left = joints_apart;
        }
        left -= length;
    }
    return even;
}

void add_pigtail(Polyline& joints) {
    constexpr double radius = 5, turn = 3.15 * std::numbers::pi, step = 1.5;  // [mm], [rad], [mm]
    if (joints.size() < 2) return;
    Vec3 along = (joints.back() - joints[joints.size() - 2]).normalized();
    Vec3 axis, other;
    geometry::tangent_basis(along, axis, other);
    for (double gone = 0; gone < turn * radius; gone += step) {
        along = geometry::rotation(step / radius, axis) * along;
        joints.push_back(joints.back() + step * along);
    }
}

}  // namespace

StillTube introducer_of(const anatomy::Anatomy& anatomy) {
    constexpr double clearance = 0.25;       // around the largest device that its French size names [mm]
    constexpr double wall = 0.33;            // of a sheath [mm]
    constexpr double deep = 6, guide = 400;  // radius of a vessel inside the trunk; length [mm]
    StillTube tube;
    for (const anatomy::VesselEnd& end : anatomy.ends) {
        const geometry::OpenEnd& opening = end.opening;
        if (opening.goes_on != geometry::Continuation::Sheath) continue;
        const bool inside = end.role == anatomy::EndRole::Inlet || opening.radius > deep;
        tube.spec.inner_diameter = 2 * opening.bore + clearance;
        tube.spec.outer_diameter = tube.spec.inner_diameter + 2 * wall;
        tube.spec.length = inside ? std::max(guide, opening.length) : opening.length;
        const bool across = std::abs(opening.outward_normal.z()) < 0.7;
        tube.joints =
            led_out(opening.centre, opening.outward_normal,
                    inside && across ? Vec3::UnitZ() : opening.outward_normal, 6, 18, tube.spec.length);
        tube.look = look_of(tube.spec, 2);
    }
    return tube;
}

physics::DeviceSpec flush_catheter() {
    physics::DeviceSpec spec;
    spec.outer_diameter = 5.0 / 3;
    spec.inner_diameter = 1.1;
    spec.length = 650;
    return spec;
}

StillTube flush_catheter_to(const anatomy::Anatomy& anatomy, const blood::FlowCell& cell) {
    constexpr double wide = 7;                  // of a vessel that a pigtail opens in, radius [mm]
    constexpr double outside = 120, cuts = 20;  // [mm]
    int from = -1;
    for (int pass = 0; pass < 2 && from < 0; ++pass)
        for (int e = 0; e < static_cast<int>(anatomy.ends.size()); ++e) {
            const anatomy::VesselEnd& end = anatomy.ends[static_cast<std::size_t>(e)];
            const bool entry = end.opening.goes_on == geometry::Continuation::Sheath;
            if (pass == 0 && (entry || end.role == anatomy::EndRole::Inlet)) continue;
            if (from < 0 || end.opening.radius > anatomy.ends[static_cast<std::size_t>(from)].opening.radius)
                from = e;
        }
    StillTube tube;
    tube.spec = flush_catheter();
    tube.look = look_of(tube.spec, 0);
    if (from < 0) return tube;
    const geometry::OpenEnd& opening = anatomy.ends[static_cast<std::size_t>(from)].opening;
    Polyline way = anatomy::path_from(anatomy, from).points;
    const auto nearest = std::ranges::min_element(
        way, {}, [&](const Vec3& point) { return (point - cell.centre).squaredNorm(); });
    way.erase(nearest + 1, way.end());
    if ((way.back() - cell.centre).norm() > joints_apart) way.push_back(cell.centre);
    way.insert(way.begin(), opening.centre + outside * opening.outward_normal);
    tube.joints = smoothed(smoothed(evenly(way), cuts), cuts);
    if (cell.radius > wide) add_pigtail(tube.joints);
    return tube;
}

}  // namespace exercise

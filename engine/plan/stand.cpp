#include "engine/plan/stand.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "engine/exercise/body.h"
#include "engine/exercise/room_in_beam.h"

namespace plan {
namespace {

using geometry::Vec3;

bool within(const TableBox& box, const Vec3& x) {
    return (x.array() >= box.least.array()).all() && (x.array() <= box.most.array()).all();
}

/// Whether the cylinder of the detector's housing has a point in the box; looked at on rings 32 mm apart or
/// less, which are nearer to each other than the table is wide.
bool meets(const TableBox& box, const Vec3& face, const render::ArmAxes& axes, double radius, double depth) {
    constexpr int rings = 6, around = 36, layers = 4;
    for (int layer = 0; layer <= layers; ++layer)
        for (int ring = 0; ring <= rings; ++ring)
            for (int k = 0; k < (ring == 0 ? 1 : around); ++k) {
                const double angle = 2 * std::numbers::pi * k / around, r = radius * ring / rings;
                if (within(box, face + depth * layer / layers * axes.beam +
                                    r * (std::cos(angle) * axes.right + std::sin(angle) * axes.up)))
                    return true;
            }
    return false;
}

}  // namespace

std::string_view text_of(Blocked blocked) {
    switch (blocked) {
        case Blocked::Free:
            return "free";
        case Blocked::BeyondRange:
            return "beyond the stand's range";
        case Blocked::Table:
            return "detector or tube would meet the table";
        case Blocked::Patient:
            return "detector or tube would meet the patient";
    }
    return "";
}

Blocked Stand::at(double lao_angle, double cranial_angle, const Vec3& isocentre) const {
    constexpr double slack = 1e-9;  // of a conversion from degrees
    const auto beyond = [](double angle, const render::ArmLimits::Range& range) {
        return !(angle >= range.least * geometry::degree - slack &&
                 angle <= range.most * geometry::degree + slack);
    };
    if (beyond(lao_angle, lao) || beyond(cranial_angle, cranial)) return Blocked::BeyondRange;
    render::CArm arm;
    arm.lao = lao_angle, arm.cranial = cranial_angle;
    arm.sid = sid, arm.sod = sod, arm.isocentre = isocentre;
    const render::ArmAxes axes = render::axes(arm);
    const Vec3 focus = render::source(arm), face = focus + sid * axes.beam;
    if (table) {
        const Vec3 nearest = focus.cwiseMax(table->least).cwiseMin(table->most);
        if ((focus - nearest).norm() < tube_radius ||
            meets(*table, face, axes, detector_radius, detector_depth))
            return Blocked::Table;
    }
    for (const Vec3& x : skin) {
        if ((x - focus).squaredNorm() < tube_radius * tube_radius) return Blocked::Patient;
        const Vec3 from_face = x - face;
        const double depth = axes.beam.dot(from_face);
        if (depth >= 0 && depth <= detector_depth &&
            (from_face - depth * axes.beam).squaredNorm() < detector_radius * detector_radius)
            return Blocked::Patient;
    }
    return Blocked::Free;
}

Stand stand_of(const scenario::Scenario& scenario, const anatomy::Anatomy& anatomy,
               const anatomy::ModelCache& cache) {
    Stand stand;
    stand.sid = scenario.c_arm.sid, stand.sod = scenario.c_arm.sod;
    if (!scenario.imaging.patient || !scenario.patient_files.ct.empty()) return stand;
    const std::shared_ptr<const exercise::Body> body = exercise::body_around(anatomy, cache);
    for (const render::TissueLayer& layer : exercise::room_in_beam(scenario, body.get())) {
        if (layer.name != "table top" && layer.name != "mattress") continue;
        for (const Vec3& v : layer.mesh.vertices) {
            if (!stand.table) stand.table = {v, v};
            stand.table->least = stand.table->least.cwiseMin(v);
            stand.table->most = stand.table->most.cwiseMax(v);
        }
    }
    const auto skin =
        std::find_if(body->layers.begin(), body->layers.end(), [](const render::TissueLayer& layer) {
            return layer.inside == render::Material::Air && !layer.mesh.vertices.empty();
        });
    // Vertices lie millimetres apart, and the detector is as wide as a hand is long.
    constexpr std::size_t every = 4;
    if (skin != body->layers.end())
        for (std::size_t k = 0; k < skin->mesh.vertices.size(); k += every)
            stand.skin.push_back(skin->mesh.vertices[k]);
    return stand;
}

}  // namespace plan

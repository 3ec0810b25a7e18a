#include "engine/exercise/room_in_beam.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "render/patient/solids.h"

namespace exercise {
namespace {

using geometry::Vec3;
using render::Material;
using render::TissueLayer;

/// From side to side, with rounded edges; along the patient.
geometry::TriangleMesh board(const Vec3& middle, double half_width, double half_height, double half_length) {
    constexpr double exponent = 5;
    std::vector<render::Ring> rings;
    for (const double end : {-1.0, 1.0})
        rings.push_back({middle + end * half_length * Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitY(), half_width,
                         half_height, exponent});
    return render::loft(rings, 64);
}

/// Dimensions of table tops by several makers; two skins of 1.7 mm of soft tissue stop as much at 60 keV as
/// 0.9 mm of aluminium (stated for table tops: 0.6 to 1.2 mm). A foam mattress has a tenth of water's density
/// or less; the lung's material has a quarter, so that it is drawn thinner.
void add_table(const Vec3& under_back, std::vector<TissueLayer>& layers) {
    constexpr double half_length = 600, skin = 1.7;  // [mm]
    constexpr double half_width = 230, half_height = 14, mattress_half_width = 215, mattress_half_height = 6;
    const Vec3 mattress = under_back + (mattress_half_height + 1) * Vec3::UnitY(),
               table = mattress + (mattress_half_height + half_height + 1) * Vec3::UnitY();
    layers.push_back({"mattress", Material::Lung, Material::Air,
                      board(mattress, mattress_half_width, mattress_half_height, half_length)});
    layers.push_back({"table top", Material::SoftTissue, Material::Air,
                      board(table, half_width, half_height, half_length)});
    layers.push_back({"table core", Material::Air, Material::SoftTissue,
                      board(table, half_width - skin, half_height - skin, half_length - 5)});
}

/// The place on the front of the skin, or none where the body does not reach [mm].
std::optional<Vec3> on_skin(const TissueLayer& skin, double x, double z) {
    constexpr double beside = 2;  // from the skin to the middle of what lies on it
    std::optional<Vec3> front;
    for (const auto& triangle : skin.mesh.triangles) {
        const Vec3 &a = skin.mesh.vertices[triangle[0]], &b = skin.mesh.vertices[triangle[1]],
                   &c = skin.mesh.vertices[triangle[2]];
        const double whole = (b.x() - a.x()) * (c.z() - a.z()) - (c.x() - a.x()) * (b.z() - a.z());
        if (whole == 0) continue;
        const double of_b = ((x - a.x()) * (c.z() - a.z()) - (c.x() - a.x()) * (z - a.z())) / whole,
                     of_c = ((b.x() - a.x()) * (z - a.z()) - (x - a.x()) * (b.z() - a.z())) / whole;
        if (of_b < 0 || of_c < 0 || of_b + of_c > 1) continue;
        const double y = a.y() + of_b * (b.y() - a.y()) + of_c * (c.y() - a.y()) - beside;
        if (!front || y < front->y()) front = Vec3(x, y, z);
    }
    return front;
}

/// In the body frame, from the electrode on (x, z): on both shoulders and below the ribs, led off to the left
/// above and below the heart [mm].
using Lead = std::array<std::array<double, 2>, 6>;
constexpr Lead leads[] = {
    {{{-125, 425}, {-100, 402}, {-60, 392}, {-10, 396}, {50, 405}, {110, 404}}},
    {{{125, 425}, {128, 412}, {130, 400}, {134, 385}, {138, 370}, {142, 350}}},
    {{{-115, 175}, {-80, 160}, {-40, 154}, {10, 156}, {60, 165}, {105, 185}}},
    {{{115, 165}, {122, 175}, {128, 188}, {133, 202}, {137, 220}, {140, 240}}},
};

/// A smooth line through the places of a lead on the skin; short where the body ends.
geometry::Polyline line_of(const Lead& lead, const TissueLayer& skin, const Vec3& origin) {
    constexpr int between = 8;
    geometry::Polyline line;
    for (std::size_t k = 0; k + 1 < lead.size(); ++k)
        for (int part = 0; part < between; ++part) {
            // Catmull and Rom's spline.
            const double t = static_cast<double>(part) / between;
            std::array<double, 2> at;
            for (std::size_t c = 0; c < 2; ++c) {
                const double p0 = lead[k == 0 ? 0 : k - 1][c], p1 = lead[k][c], p2 = lead[k + 1][c],
                             p3 = lead[std::min(k + 2, lead.size() - 1)][c];
                at[c] = 0.5 * (2 * p1 + t * (p2 - p0) + t * t * (2 * p0 - 5 * p1 + 4 * p2 - p3) +
                               t * t * t * (3 * p1 - p0 - 3 * p2 + p3));
            }
            const std::optional<Vec3> place = on_skin(skin, origin.x() + at[0], origin.z() + at[1]);
            if (!place) return line;
            line.push_back(*place);
        }
    for (int pass = 0; pass < 4; ++pass)
        for (std::size_t i = 1; i + 1 < line.size(); ++i)
            line[i].y() = 0.25 * line[i - 1].y() + 0.5 * line[i].y() + 0.25 * line[i + 1].y();
    return line;
}

void add_leads(const TissueLayer& skin, const Vec3& origin, std::vector<TissueLayer>& layers) {
    for (const Lead& lead : leads) {
        const geometry::Polyline line = line_of(lead, skin, origin);
        if (line.size() < 4) continue;
        layers.push_back({"electrode", Material::Steel, Material::Air,
                          render::ellipsoid(line.front(), Vec3(2.2, 1.0, 2.2), 16)});
        const std::vector<double> radii(line.size() - 1, 0.9);
        layers.push_back({"lead", Material::Aluminium, Material::Air,
                          render::tube({line.begin() + 1, line.end()}, Vec3::UnitY(), radii, radii, 8)});
    }
}

}  // namespace

std::vector<TissueLayer> room_in_beam(const scenario::Scenario& scenario, const Body* body) {
    std::vector<TissueLayer> layers;
    if (!body) return layers;
    const auto skin = std::find_if(body->layers.begin(), body->layers.end(), [](const TissueLayer& layer) {
        return layer.inside == Material::Air && !layer.mesh.vertices.empty();
    });
    if (skin == body->layers.end()) return layers;
    if (scenario.imaging.table) {
        double back = -std::numeric_limits<double>::infinity();
        for (const Vec3& v : skin->mesh.vertices) back = std::max(back, v.y());
        add_table({body->origin.x(), back, scenario.c_arm.isocentre.z()}, layers);
    }
    if (scenario.imaging.leads) add_leads(*skin, body->origin, layers);
    return layers;
}

}  // namespace exercise

#include "engine/anatomy/import/body_place.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <fmt/format.h>

#include "engine/io/error.h"
#include "engine/io/text.h"

namespace anatomy {
namespace {

using geometry::Landmark;
using geometry::Vec3;

struct Assumed {
    Vec3 at;
    const char* why;
};

/// In pelvis and abdomen the widest branch is an iliac artery.
Assumed bifurcation(const Anatomy& anatomy, const Eigen::AlignedBox3d& box) {
    const geometry::CentrelineBranch* widest = nullptr;
    const auto width = [](const geometry::CentrelineBranch& b) { return b.radii[b.radii.size() / 3]; };
    for (const geometry::CentrelineBranch& branch : anatomy.branches)
        if (branch.parent >= 0 && (!widest || width(branch) > width(*widest))) widest = &branch;
    if (widest) return {widest->points.front(), "where the widest branch leaves"};
    return {box.center(), "the middle of the vessels, which have no branch"};
}

/// Of the wide ends that of the ascending aorta lies in front.
Assumed valve(const Anatomy& anatomy) {
    const VesselEnd* best = nullptr;
    double widest = 0;
    for (const VesselEnd& end : anatomy.ends) widest = std::max(widest, end.opening.radius);
    for (const VesselEnd& end : anatomy.ends) {
        if (end.opening.radius < 0.7 * widest) continue;
        if (!best || end.opening.centre.y() < best->opening.centre.y()) best = &end;
    }
    return {best->opening.centre, "the foremost of the wide ends"};
}

/// The carotids pass beside the sella some way below the highest vessels.
Assumed sella(const Eigen::AlignedBox3d& box) {
    constexpr double below_top = 60, skull = 120;  // [mm]
    Vec3 at = box.center();
    if (box.sizes().z() <= skull) return {at, "the middle of the vessels"};
    at.z() = box.max().z() - below_top;
    return {at, "60 mm below the highest vessels, in their middle"};
}

}  // namespace

Landmark landmark_of_part(const std::string& part) {
    if (part == "pelvis" || part == "abdomen") return Landmark::AorticBifurcation;
    if (part == "chest") return Landmark::AorticValve;
    if (part == "head") return Landmark::Sella;
    throw io::InputError("--body: '{}' was found; pelvis, abdomen, chest or head is accepted",
                         part.substr(0, 40));
}

std::string place_in_part(Anatomy& anatomy, const std::string& part, const std::optional<Vec3>& landmark) {
    const Landmark hung_on = landmark_of_part(part);
    Eigen::AlignedBox3d box;
    for (const Vec3& v : anatomy.lumen.vertices) box.extend(v);
    const Assumed assumed = landmark                           ? Assumed{*landmark, "as given"}
                            : hung_on == Landmark::AorticValve ? valve(anatomy)
                            : hung_on == Landmark::Sella       ? sella(box)
                                                               : bifurcation(anatomy, box);
    anatomy.body = geometry::BodyPlace{hung_on, assumed.at};
    return fmt::format("in the body ({}) the {} lies at {}, {}{}", part, geometry::name_of(hung_on),
                       io::place_text(assumed.at), assumed.why,
                       landmark ? "" : "; --landmark X,Y,Z puts it elsewhere [mm]");
}

}  // namespace anatomy

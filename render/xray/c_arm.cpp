#include "render/xray/c_arm.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "physics/geometry/vec.h"

namespace render {

bool operator==(const CArm& a, const CArm& b) {
    return a.lao == b.lao && a.cranial == b.cranial && a.sid == b.sid && a.sod == b.sod &&
           a.isocentre == b.isocentre && a.detector_width == b.detector_width &&
           a.opening_width == b.opening_width && a.opening_height == b.opening_height && a.wedge == b.wedge &&
           a.lung_shutter == b.lung_shutter && a.pixels == b.pixels;
}

bool same_pose(const CArm& a, const CArm& b) {
    CArm like_b = a;
    like_b.opening_width = b.opening_width;
    like_b.opening_height = b.opening_height;
    like_b.wedge = b.wedge;
    like_b.lung_shutter = b.lung_shutter;
    return like_b == b;
}

void CArm::state(geometry::StateStream& s) {
    s(lao, cranial, sid, sod, isocentre, detector_width, opening_width, opening_height, pixels);
    std::vector<double> filters;
    if (wedge.is_in() || lung_shutter.is_in())
        filters = {wedge.edge, wedge.angle, lung_shutter.edge, lung_shutter.angle};
    s.unless_empty(filters);
    if (!s.restores()) return;
    wedge = lung_shutter = {};
    if (filters.size() != 4) return;
    wedge = {filters[0], filters[1]};
    lung_shutter = {filters[2], filters[3]};
}

std::vector<std::string> problems(const CArm& arm) {
    // Rounding in a conversion from degrees must not reject the limit itself.
    constexpr double slack = 1e-9;
    std::vector<std::string> found;
    const auto require = [&found](bool holds, std::string sentence) {
        if (!holds) found.push_back(std::move(sentence));
    };
    const auto text = [](double number) {
        std::ostringstream stream;
        stream << number;
        return stream.str();
    };
    // Each comparison is written so that NaN fails it.
    const auto require_angle = [&](const char* name, double angle, double most) {
        require(std::abs(angle) <= most * geometry::degree + slack,
                std::string("the ") + name + " angle must lie within " + text(most) + " degrees; " +
                    text(angle / geometry::degree) + " was found");
    };
    require_angle("LAO/RAO", arm.lao, ArmLimits::lao.most);
    require_angle("cranial/caudal", arm.cranial, ArmLimits::cranial.most);
    require(arm.sod > 0.0 && std::isfinite(arm.sod),
            "the distance from source to isocentre must be positive");
    require(arm.sid > 0.0 && std::isfinite(arm.sid), "the distance from source to detector must be positive");
    require(arm.sod < arm.sid, "the isocentre must lie between source and detector (sod < sid); it is " +
                                   text(arm.sod) + " mm from the source, the detector " + text(arm.sid) +
                                   " mm");
    require(arm.detector_width > 0.0 && arm.detector_width <= 1000.0,
            "the detector must be wider than 0 mm and at most 1000 mm");
    require(arm.opening_width > 0.0 && arm.opening_height > 0.0 && arm.opening_width <= widest_opening &&
                arm.opening_height <= widest_opening,
            "the collimator must open by more than 0 mm and at most 1000 mm");
    for (const BeamFilter& filter : {arm.wedge, arm.lung_shutter})
        require(std::abs(filter.edge) <= widest_opening && std::isfinite(filter.angle),
                "a filter's edge must lie within 1000 mm of the image's middle, at a finite angle");
    require(arm.pixels >= 1 && arm.pixels <= 4096, "the image must have 1 to 4096 pixels along a side");
    require(arm.isocentre.allFinite(), "the isocentre must be finite");
    return found;
}

ArmAxes axes(const CArm& arm) {
    const double ca = std::cos(arm.lao), sa = std::sin(arm.lao);
    const double cb = std::cos(arm.cranial), sb = std::sin(arm.cranial);
    return {Vec3(sa * cb, -ca * cb, sb), Vec3(ca, sa, 0.0), Vec3(-sa * sb, ca * sb, cb)};
}

Vec3 source(const CArm& arm) {
    return arm.isocentre - arm.sod * axes(arm).beam;
}

double pixel_width(const CArm& arm) {
    return arm.detector_width / arm.pixels;
}

PixelBox opening_of(const CArm& arm) {
    const double middle = 0.5 * arm.pixels, width = pixel_width(arm);
    const double across = 0.5 * std::min(arm.opening_width, arm.detector_width) / width;
    const double along = 0.5 * std::min(arm.opening_height, arm.detector_width) / width;
    return {middle - across, middle - along, middle + across, middle + along};
}

double open_area(const CArm& arm) {
    return std::min(arm.opening_width, arm.detector_width) * std::min(arm.opening_height, arm.detector_width);
}

Pixel project(const CArm& arm, const Vec3& point) {
    const ArmAxes a = axes(arm);
    const Vec3 from_isocentre = point - arm.isocentre;
    const double depth = arm.sod + a.beam.dot(from_isocentre);
    const double scale = arm.sid / (depth * pixel_width(arm));
    return {0.5 * arm.pixels + scale * a.right.dot(from_isocentre),
            0.5 * arm.pixels - scale * a.up.dot(from_isocentre), depth};
}

Eigen::Matrix<double, 3, 4> camera_matrix(const CArm& arm) {
    const ArmAxes a = axes(arm);
    const double scale = arm.sid / pixel_width(arm), middle = 0.5 * arm.pixels;
    Eigen::Matrix3d turned;
    turned.row(0) = scale * a.right + middle * a.beam;
    turned.row(1) = -scale * a.up + middle * a.beam;
    turned.row(2) = a.beam;
    Eigen::Matrix<double, 3, 4> camera;
    camera.leftCols<3>() = turned;
    camera.col(3) = -turned * source(arm);
    return camera;
}

Vec3 ray_direction(const CArm& arm, double x, double y) {
    const ArmAxes a = axes(arm);
    const double step = pixel_width(arm);
    return (arm.sid * a.beam + (x - 0.5 * arm.pixels) * step * a.right - (y - 0.5 * arm.pixels) * step * a.up)
        .normalized();
}

}  // namespace render

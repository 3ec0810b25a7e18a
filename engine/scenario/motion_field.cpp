#include "engine/scenario/motion_field.h"

#include <algorithm>
#include <cmath>

#include "physics/geometry/maths.h"

namespace scenario {
namespace {

using geometry::Vec3;

/// From the base to the apex: to the left, the front and the feet, 45 degrees each way from the body's axis
/// (texts); and how far that is [mm].
const Vec3 long_axis = Vec3(0.6, -0.6, -0.53).normalized();
constexpr double long_axis_length = 90;
/// Of the base's way, what the apex does not go; narrowing of the heart's outside at its waist; twist of the
/// apex against the base. Estimates, of the size that tagged MRI finds: the base goes by 10 to 15 mm and the
/// apex by 2 or less, the outer wall comes in by 5 to 10 %, the apex turns by 5 to 10 degrees. They are kept
/// small as heart_reach is, which exercises have at half of what a heart does.
constexpr double left_behind = 0.5, narrowing = 0.045, twist = 4 * geometry::degree;
/// What lies within this of the middle moves with the heart; outside it fades as a normal distribution of the
/// other does: no vessel is stretched by much more than a tenth [mm].
constexpr double heart_size = 55, fading = 45;
/// Of the heart's way in breathing, what the aorta away from it goes at least: spine and neck hold it
/// (estimate) [-].
constexpr double held_by_spine = 0.35;

}  // namespace

MotionField::MotionField(const VesselMotion& motion, const blood::BloodFlow& blood) : motion_(motion) {
    Vec3 sum = Vec3::Zero();
    int count = 0, root = -1;
    for (const blood::Outlet& outlet : blood.outlets) {
        if (outlet.organ != "heart") continue;
        sum += outlet.place;
        ++count;
        // Up to where the coronary arteries begin: at a wide vessel, or at the start of all.
        constexpr double wide = 6;  // radius [mm]
        for (int cell = outlet.cell; cell >= 0 && blood.cells[static_cast<std::size_t>(cell)].radius < wide;
             cell = blood.cells[static_cast<std::size_t>(cell)].upstream)
            root = cell;
    }
    if (count == 0 || root < 0) return;
    const Vec3 base = blood.cells[static_cast<std::size_t>(root)].centre;
    heart_ = Heart{base, 0.5 * (base + sum / count)};
}

/// 1 in the heart.
double MotionField::following(const Vec3& x) const {
    const double outside = std::max(0.0, (x - heart_->middle).norm() - heart_size) / fading;
    return geometry::exp(-0.5 * outside * outside);
}

Vec3 MotionField::systole_at(const Vec3& x) const {
    if (!heart_) return motion_.heart_reach;
    const Vec3 off = x - heart_->middle;
    const double along = off.dot(long_axis);
    const double down = std::clamp((x - heart_->base).dot(long_axis) / long_axis_length, 0.0, 1.0);
    const Vec3 across = off - along * long_axis;
    const double strength = motion_.heart_reach.isZero() ? 0 : 1;
    return following(x) * ((1 - left_behind * down) * motion_.heart_reach -
                           strength * (narrowing * across - twist * down * long_axis.cross(across)));
}

Vec3 MotionField::at(const Vec3& x, double beat, double breath) const {
    if (rigid()) return beat * motion_.heart_reach + breath * motion_.breathing_reach;
    const double share = held_by_spine + (1 - held_by_spine) * following(x);
    return beat * systole_at(x) + breath * share * motion_.breathing_reach;
}

}  // namespace scenario

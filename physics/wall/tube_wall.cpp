#include "physics/wall/tube_wall.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "physics/geometry/polyline.h"

namespace physics {
namespace {

constexpr int run = 32;  // segments in a ball

Vec3 closest_point(const Vec3& a, const Vec3& b, const Vec3& x) {
    return a + geometry::closest_fraction(a, b, x) * (b - a);
}

}  // namespace

TubeWall::TubeWall(Polyline centreline, double radius, WallStiffness stiffness, double wire_radius,
                   std::span<const OpenEnd> ends)
    : centreline_(std::move(centreline)),
      radius_(radius),
      stiffness_(std::move(stiffness)),
      wire_radius_(wire_radius),
      ends_(continued_ends(ends)) {
    if (centreline_.size() < 2) throw std::invalid_argument("a tube's centreline needs at least two points");
    for (std::size_t i = 0; i < centreline_.size(); ++i) {
        if (!centreline_[i].allFinite())
            throw std::invalid_argument("point " + std::to_string(i) +
                                        " of the tube's centreline is not finite");
        if (i > 0 && (centreline_[i] - centreline_[i - 1]).norm() < 1e-9)
            throw std::invalid_argument("points " + std::to_string(i - 1) + " and " + std::to_string(i) +
                                        " of the tube's centreline are equal");
    }
    if (!std::isfinite(radius_) || !(radius_ > wire_radius_))
        throw std::invalid_argument("the tube's radius must be larger than the wire's");
    for (std::size_t begin = 0; begin + 1 < centreline_.size(); begin += run) {
        const std::size_t end = std::min(centreline_.size() - 1, begin + run);
        Ball ball{centreline_[(begin + end) / 2], 0};
        for (std::size_t i = begin; i <= end; ++i)
            ball.radius = std::max(ball.radius, (centreline_[i] - ball.centre).norm() * (1 + 1e-12));
        balls_.push_back(ball);
    }
    if (!stiffness_.uniform()) arc_lengths_ = arc_lengths(centreline_);
    for (int e = 0; e < static_cast<int>(ends.size()); ++e) {
        const Vec3& centre = ends[static_cast<std::size_t>(e)].centre;
        const bool start =
            (centre - centreline_.front()).squaredNorm() < (centre - centreline_.back()).squaredNorm();
        for (const int where : {start ? 1 : 2, 3}) near_[static_cast<std::size_t>(where)].push_back(e);
    }
    // As CentrelineTree::ends_at: two radii along the tube.
    const int last = static_cast<int>(centreline_.size()) - 2;
    double passed = 0;
    while (until_ < last && passed < 2 * radius_)
        ++until_, passed += (centreline_[until_ + 1] - centreline_[until_]).norm();
    from_ = last + 1;
    passed = 0;
    while (from_ > 0 && passed < 2 * radius_)
        --from_, passed += (centreline_[from_ + 1] - centreline_[from_]).norm();
}

std::span<const int> TubeWall::ends_at(int segment) const {
    return near_[(segment <= until_ ? 1u : 0u) + (segment >= from_ ? 2u : 0u)];
}

int TubeWall::closest_segment(const Vec3& x, int hint) const {
    const int last = static_cast<int>(centreline_.size()) - 2;
    auto distance2 = [&](int s) {
        return (closest_point(centreline_[s], centreline_[s + 1], x) - x).squaredNorm();
    };
    if (hint < 0 || hint > last) {
        // The centre of a ball lies on the centreline: the nearest bounds the distance. A little more than
        // that, so that of segments equally close the first is found.
        double least = std::numeric_limits<double>::max();
        for (const Ball& ball : balls_) least = std::min(least, (ball.centre - x).squaredNorm());
        least = (1 + 1e-6) * least + 1e-12;
        int best = 0;
        for (std::size_t k = 0; k < balls_.size(); ++k) {
            const double reach = balls_[k].radius + std::sqrt(least);
            if ((balls_[k].centre - x).squaredNorm() > reach * reach) continue;
            const int begin = static_cast<int>(k) * run, end = std::min(last, begin + run - 1);
            for (int s = begin; s <= end; ++s)
                if (const double d = distance2(s); d < least) least = d, best = s;
        }
        return best;
    }
    // Downhill along the tube from the hint: joints move little between queries, and a joint stays in its own
    // limb of a hairpin. First skips as many segments as x lies beyond the hint's, in lengths of that one,
    // then moves in strides that double while they help, so that a far hint costs a logarithm.
    int s = hint;
    double least = distance2(s);
    const Vec3 along = centreline_[s + 1] - centreline_[s];
    const double on = std::floor((x - centreline_[s]).dot(along) / along.squaredNorm());
    if (on != 0 && std::abs(on) <= last) {
        const int guess = std::clamp(s + static_cast<int>(on), 0, last);
        if (const double there = distance2(guess); there < least) s = guess, least = there;
    }
    for (int stride = 1; stride > 0;) {
        const int down = std::max(0, s - stride), up = std::min(last, s + stride);
        const double below = distance2(down), above = distance2(up);
        if (std::min(below, above) < least) {
            s = below < above ? down : up;
            least = std::min(below, above);
            stride = std::min(stride * 2, 64);
        } else {
            stride /= 2;
        }
    }
    return s;
}

/// ∇² of the distance to the polyline: 1/ρ across the segment that holds the closest point, and across all
/// directions where that is a corner.
Mat3 TubeWall::curvature(const Vec3& along, const Vec3& normal, double distance, bool corner) {
    if (corner) return (Mat3::Identity() - normal * normal.transpose()) / distance;
    const Vec3 around = normal.cross(along).normalized();
    return around * around.transpose() / distance;
}

/// What the tube says to a joint of this radius, as if it had no ends.
void TubeWall::ask_tube(const Vec3& x, double joint, WallContact& c) const {
    const Vec3 &a = centreline_[c.station], &b = centreline_[c.station + 1];
    const double fraction = geometry::closest_fraction(a, b, x);
    const Vec3 out = x - (a + fraction * (b - a));
    const double distance = out.norm();
    c.penetration = distance + joint - radius_;
    c.clearance = radius_ - joint;
    if (distance > 1e-12) {
        c.normal = out / distance;
        c.curvature = curvature(b - a, c.normal, distance, fraction == 0 || fraction == 1);
    }
    c.trust = std::max(0.0, -c.penetration);  // the distance to the centreline changes no faster than x
}

WallContact TubeWall::contact(const Vec3& x, int hint, double thickness) const {
    WallContact c;
    const double joint = wire_radius_ + thickness;
    c.thickness = thickness;
    c.station = closest_segment(x, hint);
    c.stiffness = stiffness_.mean();
    const PastEnd past(x, ends_, ends_at(c.station), 0);
    if (past.inside()) {
        ask_tube(x, joint, c);
        past.limit(x, joint, c);
    } else {
        ask_tube(past.seen_at(x), joint, c);
        past.apply(x, joint, radius_ - joint, c);
    }
    if (!stiffness_.uniform())
        stiffness_.apply(centreline_coordinate(centreline_, arc_lengths_, c.station, x), c);
    if (!past.inside()) past.part_cusps(x, joint, stiffness_.joint_length(), c);
    return c;
}

void TubeWall::rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const {
    require_finite(joints);
    for (std::size_t i = 0; i < joints.size(); ++i)
        contacts[i] = contact(joints[i], contacts[i].station, contacts[i].thickness);
}

}  // namespace physics

#include "physics/wall/wall.h"

#include <Eigen/Cholesky>
#include <cassert>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace physics {

void require_finite(std::span<const Vec3> joints) {
    double none = 0;  // a number times zero, summed: not zero where one of them is not finite
    for (const Vec3& x : joints) none += 0 * x[0] + 0 * x[1] + 0 * x[2];
    if (none == 0) return;
    for (std::size_t i = 0; i < joints.size(); ++i) {
        if (joints[i].allFinite()) continue;
        std::ostringstream text;
        text << "a wall was asked at a position that is not finite, (" << joints[i].x() << ", "
             << joints[i].y() << ", " << joints[i].z() << ") mm, joint " << i << " of " << joints.size()
             << " asked";
        throw std::logic_error(text.str());
    }
}

/// What the vessel where it was says to a joint at that place, asked with what the other was asked with.
WallContact LumenWall::rigid_contact(const Vec3& at, int station, const WallContact& asked) const {
    WallContact c;
    c.station = station, c.thickness = asked.thickness, c.held = asked.held;
    rigid_contacts({&at, 1}, {&c, 1});
    c.share = asked.share, c.give = asked.give;
    return c;
}

/// Newton's method for the place y at which the vessel makes way for a joint at x, from a place near it; its
/// contact is `at`. False where it leads out of the wall's reach, or inside the lumen: then the joint does
/// not touch, or has to be asked for where it is.
bool LumenWall::made_way(const Vec3& x, WallContact& at, Vec3 y) const {
    constexpr int most_steps = 30;
    constexpr double longest = 0.5, exact = 1e-12, near = 1e-6;  // of a step [mm]
    const WallContact asked = at;
    const double give = asked.give, support = 1 / give;
    Mat3 of_wall;  // its Hessian at y
    for (int step = 0;; ++step) {
        if (at.normal.isZero(0)) return false;
        const double k = asked.share * at.stiffness;
        const Mat3 flat = k * at.normal * at.normal.transpose();
        of_wall = flat + k * at.penetration * at.curvature;
        // A wall that turns away from the joint more sharply than it holds it has no place of its own.
        Eigen::LDLT<Mat3> solver(support * Mat3::Identity() + of_wall);
        if (!solver.isPositive() || !(solver.vectorD().minCoeff() > 1e-3 * support)) {
            of_wall = flat;
            solver.compute(support * Mat3::Identity() + of_wall);
        }
        Vec3 by = solver.solve(support * (x - y) - k * at.penetration * at.normal);
        const double size = by.norm();
        if (size <= exact * (1 + (x - y).norm())) break;
        if (step == most_steps) {  // between two places that hold it alike
            if (size > near) return false;
            break;
        }
        if (size > longest) by *= longest / size;
        y += by;
        at = rigid_contact(y, at.station, asked);
    }
    if (!at.touches()) return false;
    const double k = asked.share * at.stiffness, in_series = 1 / (1 / k + give);
    const Vec3 push = k * at.penetration * at.normal;  // at rest that of the vessel, too: (x − y)/give
    // The sum that y makes least, to second order in what y is off by.
    const double energy = 0.5 * (support * (x - y).squaredNorm() + k * at.penetration * at.penetration);
    at.penetration = std::sqrt(2 * energy / in_series);
    if (!(at.penetration > 0)) return false;
    const double force = in_series * at.penetration;
    at.normal = push / force;
    const Mat3 second = of_wall * (Mat3::Identity() + give * of_wall).inverse();
    at.curvature = (second - in_series * at.normal * at.normal.transpose()) / force;
    at.stiffness = in_series;
    at.stiffening.setZero();
    at.share = asked.share, at.give = asked.give, at.given = give * push;
    return true;
}

/// The contact of one joint where its vessel makes way.
WallContact LumenWall::yielding(const Vec3& x, const WallContact& asked) const {
    if (!asked.given.isZero(0)) {
        const Vec3 y = x - asked.given;
        WallContact c = rigid_contact(y, asked.station, asked);
        if (made_way(x, c, y)) return c;
    }
    WallContact c = rigid_contact(x, asked.station, asked);
    if (c.touches()) {
        const double k = asked.share * c.stiffness, slope = c.normal.squaredNorm();
        const double way = asked.give * k * c.penetration / (1 + asked.give * k * slope);
        const Vec3 y = x - way * c.normal;
        WallContact there = rigid_contact(y, c.station, asked);
        if (made_way(x, there, y)) return there;
    }
    c.soften(asked.share);
    if (c.touches()) {  // along the normal that the wall has for it
        c.stiffness = 1 / (1 / c.stiffness + asked.give);
        c.given = asked.give * c.force() * c.normal;
    }
    return c;
}

void LumenWall::contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const {
    assert(joints.size() == contacts.size());
    // A run of joints whose vessels stay where they are is asked for at once.
    thread_local std::vector<double> shares;
    const auto stays = [](const WallContact& c) { return c.give == 0; };
    for (std::size_t i = 0; i < joints.size();) {
        if (!stays(contacts[i])) {
            contacts[i] = yielding(joints[i], contacts[i]);
            ++i;
            continue;
        }
        std::size_t end = i;
        shares.clear();
        for (; end < joints.size() && stays(contacts[end]); ++end) shares.push_back(contacts[end].share);
        rigid_contacts(joints.subspan(i, end - i), contacts.subspan(i, end - i));
        for (const double share : shares) {
            contacts[i].soften(share);
            contacts[i++].share = share;
        }
    }
}

}  // namespace physics

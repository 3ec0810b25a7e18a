#include "physics/wall/wall.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "physics/wall/foundation.h"

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
    c.fraction = asked.fraction, c.give = asked.give, c.along = asked.along;
    return c;
}

namespace {

/// Hessian of k pen²/2, with k as it is there; or of its flat part, which is positive.
Mat3 hessian(const WallContact& at, double k, bool whole) {
    Mat3 second = k * at.normal * at.normal.transpose();
    if (whole) second += k * at.penetration * at.curvature;
    return second;
}

/// What makes way, of a step or of a Hessian: nothing along the vessel.
struct Across {
    Vec3 along;
    Vec3 operator()(const Vec3& v) const { return v - along.dot(v) * along; }
    Mat3 operator()(const Mat3& m) const {
        const Mat3 across = Mat3::Identity() - along * along.transpose();
        return across * m * across;
    }
};

Vec3 newton_step(const Across& across, const WallContact& at, double k, double support, const Vec3& given) {
    Eigen::LDLT<Mat3> solver(support * Mat3::Identity() + across(hessian(at, k, true)));
    // A wall that turns away from the joint more sharply than the vessel is held.
    if (!solver.isPositive() || !(solver.vectorD().minCoeff() > 1e-3 * support))
        solver.compute(support * Mat3::Identity() + across(hessian(at, k, false)));
    const Vec3 push = k * at.penetration * at.normal;
    return across(Vec3(solver.solve(support * given - across(push))));
}

double wall_energy(const WallContact& at, double k) {
    return at.touches() ? 0.5 * k * at.penetration * at.penetration : 0.0;
}

}  // namespace

/// Newton's method for the place y at which the vessel makes way for a joint at x, from one near it. Every
/// step lowers the energy. The last one, in which the wall is what its derivatives say, is not made, but
/// returned. Empty where it leads out of the wall's reach or of the wall.
std::optional<Vec3> LumenWall::find_place(const Vec3& x, WallContact& at, Vec3& y) const {
    constexpr int most_steps = 20, most_halvings = 6;
    constexpr double longest = 0.5, exact = 1e-6, rounded = 1e-5;  // of a step [mm]
    const WallContact asked = at;
    const double support = 1 / asked.give;
    const Across across{asked.along};
    const auto k_of = [&](const WallContact& c) { return asked.fraction * c.stiffness; };
    const auto energy = [&](const WallContact& c, const Vec3& place) {
        return 0.5 * support * (x - place).squaredNorm() + wall_energy(c, k_of(c));
    };
    for (int step = 0; step < most_steps; ++step) {
        if (at.normal.isZero(0)) break;
        const double k = k_of(at);
        Vec3 by;
        if (at.touches()) {
            by = newton_step(across, at, k, support, x - y);
        } else {
            // Back towards x, to where the wall bears what the vessel does here, if it is flat.
            by = across(Vec3(x - y));
            const double nearer = at.normal.dot(by);
            if (by.isZero(0) || !(nearer > 0)) break;
            by *= std::min(1.0, (-at.penetration + support * (x - y).norm() / k) / nearer);
        }
        const double size = by.norm();
        if (at.touches() && size <= exact) return by;
        if (!std::isfinite(size)) break;
        if (size > longest) by *= longest / size;
        const double before = energy(at, y), rounding = 1e-14 * before;
        WallContact there = rigid_contact(y + by, at.station, asked);
        int halvings = 0;
        for (; energy(there, y + by) > before + rounding && halvings < most_halvings; ++halvings) {
            by *= 0.5;
            there = rigid_contact(y + by, at.station, asked);
        }
        // Where the wall has an edge, there may be no lower place and no rest here either.
        if (halvings == most_halvings) {
            if (at.touches() && size <= rounded) return Vec3::Zero();
            return std::nullopt;
        }
        y += by;
        at = there;
    }
    return std::nullopt;
}

/// The contact of a joint at x whose vessel makes way, from a place near that at which it does, whose contact
/// is `at`; false where there is none.
bool LumenWall::made_way(const Vec3& x, WallContact& at, Vec3 y) const {
    const double give = at.give;
    const WallContact asked = at;
    const std::optional<Vec3> left = find_place(x, at, y);
    if (!left) return false;
    const double k = asked.fraction * at.stiffness, in_series = 1 / (1 / k + give);
    const Across across{asked.along};
    Mat3 of_wall = hessian(at, k, true);
    Mat3 held = Mat3::Identity() + give * across(of_wall);
    if (!(held.determinant() > 1e-6)) {
        of_wall = hessian(at, k, false);
        held = Mat3::Identity() + give * across(of_wall);
    }
    const Vec3 push_there = k * at.penetration * at.normal, push = push_there + of_wall * *left;
    const double energy = 0.5 * ((x - y - *left).squaredNorm() / give + k * at.penetration * at.penetration) +
                          left->dot(push_there + 0.5 * of_wall * *left);
    at.penetration = std::sqrt(2 * energy / in_series);
    if (!(at.penetration > 0)) return false;
    const double force = in_series * at.penetration;
    at.normal = push / force;
    const Mat3 through = Mat3::Identity() - asked.along * asked.along.transpose();
    const Mat3 second = of_wall - give * of_wall * through * held.inverse() * through * of_wall;
    at.curvature = (second - in_series * at.normal * at.normal.transpose()) / force;
    at.stiffness = in_series;
    at.stiffening.setZero();
    at.fraction = asked.fraction, at.give = asked.give, at.along = asked.along;
    at.given = give * across(push);
    return true;
}

/// The contact of one joint where its vessel makes way.
WallContact LumenWall::yielding(const Vec3& x, const WallContact& asked) const {
    constexpr double least_across = 0.1;  // of a normal, squared, that makes a vessel give way [-]
    if (!asked.given.isZero(0)) {
        const Vec3 y = x - Across{asked.along}(asked.given);
        WallContact c = rigid_contact(y, asked.station, asked);
        if (made_way(x, c, y)) return c;
    }
    WallContact c = rigid_contact(x, asked.station, asked);
    if (!c.touches()) {
        c.soften(asked.fraction);
        return c;
    }
    // Where a flat wall would let the joint be. Between two vessels, where the normal all but vanishes, no
    // farther than from one to the other.
    const Vec3 normal = Across{asked.along}(c.normal);
    const double k = asked.fraction * c.stiffness;
    const double flat = 1 / k + asked.give * std::max(normal.squaredNorm(), least_across);
    Vec3 way = asked.give * c.penetration / flat * normal;
    if (const double size = way.norm(); size > 2 * c.penetration) way *= 2 * c.penetration / size;
    std::optional<WallContact> best;
    const auto look_from = [&](const Vec3& y) {
        constexpr double lower = 1 - 1e-6;
        WallContact there = rigid_contact(y, c.station, asked);
        if (made_way(x, there, y) && (!best || there.penetration < lower * best->penetration)) best = there;
    };
    look_from(x - way);
    // From within the lumen too, where the wall is known: beside it there may be another place, that is none.
    if (foundation_ && c.station >= 0) {
        constexpr double within = 0.8;  // of its wall [mm]
        const Station& station = foundation_->station(c.station);
        const Vec3 out = Across{asked.along}(Vec3(x - station.centre));
        const double keep = std::max(0.5 * station.radius, station.radius - within);
        if (const double size = out.norm(); size > keep) look_from(x - (1 - keep / size) * out);
    }
    if (best) return *best;
    // No place: as of that flat wall, whose energy is penetration²/(2 flat).
    const double scale = std::sqrt((1 / k + asked.give) / flat);
    c.penetration *= scale, c.normal *= scale, c.curvature *= scale;
    c.stiffness = 1 / (1 / k + asked.give);
    c.stiffening.setZero();
    c.given = way;
    return c;
}

/// The same of one that has been shifted before that.
WallContact LumenWall::shifted(const Vec3& x, WallContact asked) const {
    const Vec3 shift = asked.shift;
    if (!asked.given.isZero(0)) asked.given -= shift;
    WallContact c = yielding(x - shift, asked);
    c.shift = shift;
    c.given += shift;
    return c;
}

void LumenWall::contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const {
    assert(joints.size() == contacts.size());
    // A run of joints whose vessels stay where they are is asked for at once.
    thread_local std::vector<double> fractions;
    const auto stays = [](const WallContact& c) { return c.give == 0; };
    for (std::size_t i = 0; i < joints.size();) {
        if (!stays(contacts[i])) {
            contacts[i] = shifted(joints[i], contacts[i]);
            ++i;
            continue;
        }
        std::size_t end = i;
        fractions.clear();
        for (; end < joints.size() && stays(contacts[end]); ++end)
            fractions.push_back(contacts[end].fraction);
        rigid_contacts(joints.subspan(i, end - i), contacts.subspan(i, end - i));
        for (const double fraction : fractions) {
            contacts[i].soften(fraction);
            contacts[i++].fraction = fraction;
        }
    }
}

}  // namespace physics

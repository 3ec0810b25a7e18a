#include "engine/exercise/vessel_growth.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/geometry/hash.h"
#include "physics/geometry/maths.h"

namespace exercise {

using geometry::Vec3;

Vec3 in_unit_ball(geometry::Random& random) {
    while (true) {
        const double x = random.between(-1, 1), y = random.between(-1, 1), z = random.between(-1, 1);
        const Vec3 p(x, y, z);
        if (p.squaredNorm() <= 1) return p;
    }
}

std::uint64_t seed_of(const std::string& name) {
    geometry::Hash hash;
    hash.add(name.data(), name.size());
    return hash.value();
}

namespace {

constexpr double longest_piece = 6;      // [mm]
constexpr double shortest_branch = 2.5;  // of its radius, before it divides

/// Waves across a vessel, without any at its ends.
class Winding {
public:
    /// Over `length` [mm] along `direction`.
    Winding(double strength, double length, double radius, const Vec3& direction, geometry::Random& random) {
        constexpr double shortest = 5, longest = 14, radii = 9;  // of a wave: [mm], [mm], at least
        constexpr double height = 0.15;                          // of a wave, in its lengths
        if (strength <= 0) return;
        const double wave = std::max(radii * radius, random.between(shortest, longest));
        waves_ = std::min(length / wave, 12.0);
        wave_length_ = length / std::max(waves_, 1e-9);
        // A vessel shorter than a wave is a part of one.
        height_ = strength * height * wave * std::min(1.0, waves_);
        across_[0] = direction.unitOrthogonal();
        across_[1] = direction.cross(across_[0]);
        const double turn = random.between(0, 2 * std::numbers::pi);
        const Vec3 u = across_[0], v = across_[1];
        across_[0] = geometry::cos(turn) * u + geometry::sin(turn) * v;
        across_[1] = geometry::cos(turn) * v - geometry::sin(turn) * u;
        for (double& phase : phase_) phase = random.between(0, 2 * std::numbers::pi);
        flat_ = random.between(0.3, 0.9);
    }
    Vec3 at(double t) const {
        if (height_ == 0) return Vec3::Zero();
        const double ends = geometry::sin(std::numbers::pi * t), window = std::min(1.0, 3 * ends * ends);
        const double turn = 2 * std::numbers::pi * waves_ * t;
        return height_ * window *
               ((geometry::sin(turn + phase_[0]) + 0.5 * geometry::sin(0.43 * turn + phase_[1])) *
                    across_[0] +
                flat_ *
                    (geometry::sin(0.81 * turn + phase_[2]) + 0.5 * geometry::sin(1.37 * turn + phase_[3])) *
                    across_[1]);
    }
    double wave_length() const { return wave_length_; }
    bool straight() const { return height_ == 0; }

private:
    double waves_ = 0, wave_length_ = 0, height_ = 0, flat_ = 0;
    double phase_[4] = {};
    Vec3 across_[2] = {Vec3::Zero(), Vec3::Zero()};
};

class Grower {
public:
    Grower(const Root& root, std::vector<render::VesselPiece>& pieces)
        : root_(root), random_(root.seed), pieces_(pieces) {}

    void grow(std::vector<Vec3>& tissue, const NodeRange& nodes) {
        terminals_ = static_cast<double>(tissue.size());
        exponent_ = geometry::log(terminals_) / geometry::log(std::max(1.5, root_.radius / root_.smallest));
        std::vector<Vec3*> all;
        for (Vec3& p : tissue) all.push_back(&p);
        const std::size_t first = pieces_.size();
        grow(all, root_.place, root_.direction, root_.radius, 0);
        for (std::size_t k = first; k < pieces_.size(); ++k) {
            const auto bin = std::min(
                nodes.count - 1,
                static_cast<std::uint32_t>(times_[k - first] / latest_ * static_cast<double>(nodes.count)));
            pieces_[k].node = nodes.first + (nodes.to_root ? nodes.count - 1 - bin : bin);
        }
    }

private:
    double radius_of(std::size_t points) const {
        return root_.radius * geometry::pow(static_cast<double>(points) / terminals_, 1 / exponent_);
    }

    /// A vessel does not turn back at once: `direction`, but within a largest angle of the heading.
    static Vec3 turned(const Vec3& heading, const Vec3& direction) {
        constexpr double cosine = 0.5, sine = 0.8660254;
        const double along = heading.dot(direction);
        if (along >= cosine) return direction;
        const Vec3 aside = direction - along * heading;
        return cosine * heading +
               sine * (aside.norm() > 1e-6 ? Vec3(aside.normalized()) : Vec3(heading.unitOrthogonal()));
    }

    void grow(std::vector<Vec3*>& points, const Vec3& from, const Vec3& heading, double before, double time) {
        const double radius = radius_of(points.size());
        Vec3 middle = Vec3::Zero();
        for (const Vec3* p : points) middle += *p / static_cast<double>(points.size());
        const bool last = points.size() == 1;
        // Far from its territory a vessel runs there; within, it divides on the way to the middle.
        const double part = last ? 1 : random_.between(0.3, 0.55), away = (middle - from).norm();
        Vec3 direction = away > 1e-6 ? Vec3((middle - from) / away) : heading;
        double length = part * away;
        if (!last) {
            direction = turned(heading, direction);
            length = std::max(length, shortest_branch * radius);
        }
        const Vec3 to = from + length * direction;
        const Vec3 end_heading = draw(from, heading, to, direction, before, radius, time);
        if (last) return;
        // Resting velocity is proportional to radius in Murray's trees.
        const double later = time + length / radius;
        // Divides by a plane that holds the way, across the widest direction.
        Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
        for (const Vec3* p : points) {
            const Vec3 off = *p - middle;
            const Vec3 across = off - off.dot(direction) * direction;
            spread += across * across.transpose();
        }
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
        const Vec3 widest = axes.eigenvectors().col(2);
        std::ranges::sort(points,
                          [&](const Vec3* a, const Vec3* b) { return a->dot(widest) < b->dot(widest); });
        const double fraction = random_() < 0.5 ? random_.between(root_.least_part, root_.largest_part)
                                                : 1 - random_.between(root_.least_part, root_.largest_part);
        const auto cut = std::clamp<std::size_t>(
            static_cast<std::size_t>(fraction * static_cast<double>(points.size())), 1, points.size() - 1);
        std::vector<Vec3*> left(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(cut)),
            right(points.begin() + static_cast<std::ptrdiff_t>(cut), points.end());
        points.clear();
        points.shrink_to_fit();
        grow(left, to, end_heading, radius, later);
        grow(right, to, end_heading, radius, later);
    }

    /// A cubic from one heading to the next, in straight pieces, from the trunk's width on; returns the
    /// heading at its end.
    Vec3 draw(const Vec3& from, const Vec3& heading, const Vec3& to, const Vec3& direction, double before,
              double radius, double time) {
        const double length = (to - from).norm();
        const Vec3 in = (direction + 0.15 * in_unit_ball(random_)).normalized();
        // Straight on from the lumen.
        const Winding winding(time == 0 ? 0 : root_.winding, length, radius, direction, random_);
        if (length < 1e-3) return heading;
        // A mouth is little wider than the branch, and narrows over its width.
        const double mouth = std::min(before, 1.5 * radius), narrowing = std::min(2.5 * mouth, 0.6 * length);
        double step = std::min({longest_piece, 4 * radius, length / 2});
        if (!winding.straight()) step = std::min(step, std::max(0.5, winding.wave_length() / 12));
        if (heading.dot(direction) < 0.9) step = std::min(step, length / 10);
        const int count = std::clamp(static_cast<int>(std::ceil(length / step)), 2, 200);
        Vec3 at = from;
        double way = 0;
        const auto place = [&](double t) {
            const double t2 = t * t, t3 = t2 * t;
            return Vec3((2 * t3 - 3 * t2 + 1) * from + (t3 - 2 * t2 + t) * length * heading +
                        (3 * t2 - 2 * t3) * to + (t3 - t2) * length * in + winding.at(t));
        };
        const auto add = [&](double begin, double end) {
            const Vec3 next = place(end);
            const double now = way + 0.5 * (next - at).norm(),
                         wide = std::clamp(1 - now / narrowing, 0.0, 1.0);
            const double there = radius + (mouth - radius) * wide * wide * (3 - 2 * wide);
            const Vec3 ahead = (next - at).normalized();
            const Vec3 begins = begin > 0 ? joined(pieces_.back(), ahead) : heading;
            pieces_.push_back({at, next, static_cast<float>(there), 1, 0, begins, ahead});
            times_.push_back(time + 0.5 * (begin + end) * length / radius);
            latest_ = std::max(latest_, times_.back());
            way += (next - at).norm();
            at = next;
        };
        for (int k = 1; k <= count; ++k) {
            const double begin = static_cast<double>(k - 1) / count, end = static_cast<double>(k) / count;
            // Finer where it narrows.
            const int parts = way < narrowing && mouth > 1.02 * radius
                                  ? std::clamp(static_cast<int>(std::ceil((mouth / radius - 1) * 12)), 1, 8)
                                  : 1;
            for (int j = 0; j < parts; ++j)
                add(begin + (end - begin) * j / parts, begin + (end - begin) * (j + 1) / parts);
        }
        pieces_.back().ends = in.cast<float>();
        return in;
    }

    const Root& root_;
    geometry::Random random_;
    std::vector<render::VesselPiece>& pieces_;
    std::vector<double> times_;  // at which blood reaches each piece, in radii of way
    double latest_ = 1e-9, exponent_ = 3, terminals_ = 1;
};

}  // namespace

Vec3 joined(render::VesselPiece& piece, const Vec3& ahead) {
    const Vec3 normal = (piece.ends.cast<double>() + ahead).normalized();
    piece.ends = normal.cast<float>();
    return normal;
}

void grow_into(std::vector<Vec3> tissue, const Root& root, const NodeRange& nodes,
               std::vector<render::VesselPiece>& pieces) {
    if (!tissue.empty()) Grower(root, pieces).grow(tissue, nodes);
}

}  // namespace exercise

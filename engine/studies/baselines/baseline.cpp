#include "engine/studies/baselines/baseline.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace baselines {

Tube::Tube(const std::vector<Piece>& pieces, double radius) : radius_(radius) {
    if (pieces.empty()) throw std::invalid_argument("a tube needs at least one piece");
    if (!(radius > 0) || !std::isfinite(radius))
        throw std::invalid_argument("the tube's radius must be positive and finite, not " +
                                    std::to_string(radius));
    Vec3 at = Vec3::Zero(), heading = Vec3::UnitX();
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        const Piece& piece = pieces[i];
        if (!(piece.length > 0) || !std::isfinite(piece.length) || !std::isfinite(piece.angle) ||
            !(piece.axis.norm() > 0) || !piece.axis.allFinite())
            throw std::invalid_argument("piece " + std::to_string(i) +
                                        " of the tube needs a positive length, a finite angle and an axis");
        const Vec3 axis = piece.axis.normalized();
        Curve curve;
        curve.from = total_;
        curve.length = piece.length;
        curve.turn = piece.angle / piece.length;
        curve.start = at;
        curve.along = axis.dot(heading) * axis;
        curve.across = heading - curve.along;
        curve.beside = axis.cross(heading);
        const Place end = place(curve, curve.length);
        at = end.point;
        heading = end.heading.normalized();
        total_ += piece.length;
        curves_.push_back(curve);
    }
}

Tube::Place Tube::place(const Curve& c, double s) {
    if (c.turn == 0) {
        const Vec3 heading = c.along + c.across;
        return {c.start + s * heading, heading, Vec3::Zero()};
    }
    const double sine = std::sin(c.turn * s), cosine = std::cos(c.turn * s);
    return {c.start + s * c.along + (sine / c.turn) * c.across + ((1 - cosine) / c.turn) * c.beside,
            c.along + cosine * c.across + sine * c.beside, c.turn * (cosine * c.beside - sine * c.across)};
}

const Tube::Curve& Tube::curve_at(double arc) const {
    std::size_t i = 0;
    while (i + 1 < curves_.size() && arc >= curves_[i + 1].from) ++i;
    return curves_[i];
}

Vec3 Tube::point(double arc) const {
    const double s = std::clamp(arc, 0.0, total_);
    const Curve& curve = curve_at(s);
    return place(curve, s - curve.from).point;
}

double Tube::nearest_arc(const Vec3& x) const {
    double best = 0, least = std::numeric_limits<double>::infinity();
    const int count = std::max(2, static_cast<int>(std::ceil(total_ / (0.25 * radius_))));
    for (int k = 0; k <= count; ++k) {
        const double arc = total_ * k / count, far = (point(arc) - x).squaredNorm();
        if (far < least) least = far, best = arc;
    }
    return best;
}

Touch Tube::touch(const Vec3& x, double& arc, bool with_curvature) const {
    // The root of (x − c)·c' by Newton's method. Its slope −1 + (x − c)·c'' is negative within the radius of
    // curvature; beyond that it is held there, so that a point far outside still finds a place.
    double s = std::clamp(std::isfinite(arc) ? arc : 0.0, 0.0, total_);
    Place here;
    Vec3 out;
    double slope = 1, step = 0;
    for (int round = 0; round < 40; ++round) {
        const Curve& curve = curve_at(s);
        here = place(curve, s - curve.from);
        out = x - here.point;
        slope = 1 - out.dot(here.bend);
        const double along = out.dot(here.heading);
        step = std::clamp(s + along / std::max(slope, 0.1), 0.0, total_) - s;
        s += step;
        if (!(std::abs(step) > 1e-7)) break;
    }
    out -= step * here.heading;  // the last, tiny step to first order
    arc = s;
    Touch touch;
    const double distance = out.norm();
    touch.depth = distance - radius_;
    if (!(distance > 1e-12)) return touch;
    touch.normal = out / distance;
    if (!with_curvature) return touch;
    touch.curvature = Mat3::Identity() - touch.normal * touch.normal.transpose();
    if (s > 0 && s < total_)
        touch.curvature -= here.heading * here.heading.transpose() / std::max(slope, 0.1);
    touch.curvature /= distance;
    return touch;
}

void Baseline::take(const std::vector<Vec3>& nodes) {
    if (nodes.size() < 2) throw std::invalid_argument("a rod needs at least two nodes");
    for (std::size_t i = 0; i < nodes.size(); ++i)
        if (!nodes[i].allFinite())
            throw std::invalid_argument("node " + std::to_string(i) + " of the rod is not finite");
    nodes_ = nodes;
    arcs_.assign(nodes.size(), 0.0);
    tally_ = {};
    diverged_ = false;
    still_ = 0;
    if (tube_)
        for (std::size_t i = 0; i < nodes.size(); ++i) arcs_[i] = tube_->nearest_arc(nodes[i]);
}

double Baseline::wall_energy() const {
    double energy = -spec_.load.dot(nodes_.back() - spec_.base);
    if (!tube_) return energy;
    for (int i = 1; i <= segments(); ++i) {
        double arc = arcs_[i];
        const double depth = std::max(0.0, tube_->touch(nodes_[i], arc, false).depth);
        energy += 0.5 * wall_stiffness(i) * depth * depth;
    }
    return energy;
}

bool Baseline::lost() const {
    const double far = 2 * segments() * spec_.segment_length;
    return std::any_of(nodes_.begin(), nodes_.end(), [&](const Vec3& x) {
        return !((x - spec_.base).squaredNorm() <= far * far);  // true for what is not a number
    });
}

}  // namespace baselines

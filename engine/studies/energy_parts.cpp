#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <tuple>

#include "engine/studies/claims.h"
#include "engine/studies/plain_wire.h"
#include "engine/studies/resolution.h"
#include "engine/studies/templates.h"

namespace studies {
namespace {

/// U_bend, Eq. 5, of a curve divided anew into chords of `lambda`: its shape is kept, as Eq. 7 supposes.
double bending_of_shape(const geometry::Polyline& shape, int segments, double lambda) {
    const auto spec = PlainWire::uniform(50, lambda, physics::EndCells::Paper);
    const physics::Chain wire = wire_along(spec, shape, segments);
    double energy = 0;
    for (int i = 1; i < segments; ++i) {
        const double cosine = wire.tangents[i].dot(wire.tangents[i + 1]);
        energy += spec.shaft_rigidity / lambda / 12 * (13 - 14 * cosine + cosine * cosine);
    }
    return energy;
}

/// A smooth curve through a wire's joints, ten points a segment, and a little beyond its tip: cubic between
/// joints, along the mean direction of the two segments at each.
geometry::Polyline smooth_through(const physics::Chain& wire) {
    const int n = wire.segments();
    const auto direction = [&](int i) -> geometry::Vec3 {
        if (i == 0 || i == n) return wire.tangents[std::max(i, 1)];
        return (wire.tangents[i] + wire.tangents[i + 1]).normalized();
    };
    geometry::Polyline curve = {wire.joints[0]};
    for (int i = 1; i <= n; ++i) {
        const geometry::Vec3 a = wire.joints[i - 1], b = wire.joints[i],
                             u = wire.lengths[i] * direction(i - 1), v = wire.lengths[i] * direction(i);
        for (int k = 1; k <= 10; ++k) {
            const double s = 0.1 * k, r = 1 - s;
            curve.push_back((1 + 2 * s) * r * r * a + s * r * r * u + s * s * (3 - 2 * s) * b -
                            s * s * r * v);
        }
    }
    curve.push_back(curve.back() + 2 * wire.lengths[n] * wire.tangents[n]);
    return curve;
}

/// ⟨θ⁴⟩/(24⟨θ²⟩), the constant of Eq. 8.
double constant_of_eq_8(const physics::Chain& wire) {
    double squares = 0, fourths = 0;
    for (int i = 1; i < wire.segments(); ++i) {
        const double theta = turn_between(wire.tangents[i], wire.tangents[i + 1]);
        squares += theta * theta;
        fourths += theta * theta * theta * theta;
    }
    return fourths / (24 * squares);
}

/// ⟨|Δθ|²⟩/(6⟨θ²⟩), Δθ the change of the turn from joint to joint, as vectors.
double change_of_curvature(const physics::Chain& wire) {
    double changes = 0, squares = 0;
    for (int i = 1; i < wire.segments(); ++i) {
        const geometry::Vec3 here = wire.tangents[i + 1] - wire.tangents[i];
        squares += here.squaredNorm();
        if (i > 1) changes += (here - (wire.tangents[i] - wire.tangents[i - 1])).squaredNorm();
    }
    return changes / (6 * squares);
}

/// Fit of y = a·x through the origin, and the rms about it over the last y.
std::pair<double, double> through_origin(const std::vector<std::pair<double, double>>& points) {
    double xx = 0, xy = 0, off = 0;
    for (const auto& [x, y] : points) xx += x * x, xy += x * y;
    const double slope = xy / xx;
    for (const auto& [x, y] : points) off += (y - slope * x) * (y - slope * x);
    return {slope, std::sqrt(off / static_cast<double>(points.size())) / std::abs(points.back().second)};
}

}  // namespace

double turn_between(const geometry::Vec3& u, const geometry::Vec3& v) {  // [rad]
    return std::atan2(u.cross(v).norm(), u.dot(v));
}

EnergyParts energy_parts(std::span<const ResolutionCurve> curves, const Resolution& resolution) {
    EnergyParts p;
    const ResolutionCurve& first = curves[curves.size() / 2];
    p.eq_8 = constant_of_eq_8(first.coarse);
    p.uneven = change_of_curvature(first.coarse);
    p.fit = curves.front().fit;
    p.wall_fraction = quantiles(curves, &ResolutionCurve::wall_fraction).median;
    for (const physics::Chain* wire : {&first.coarse, &first.fine}) {
        double exact = 0, series = 0;
        for (int i = 1; i < wire->segments(); ++i) {
            const double theta = turn_between(wire->tangents[i], wire->tangents[i + 1]),
                         cosine = std::cos(theta), c = 50 / wire->lengths[i];
            exact += c / 12 * (13 - 14 * cosine + cosine * cosine);
            series += c / 2 * (theta * theta - theta * theta * theta * theta / 24);
        }
        p.eq_6 = std::max(p.eq_6, std::abs(series / exact - 1));
    }
    const geometry::Polyline shape = smooth_through(first.fine);
    std::vector<std::pair<double, double>> same_shape, wall, early;
    const double wire_length = resolution.coarse;
    const int widest = resolution.coarse;
    const double base_shape = bending_of_shape(shape, widest, wire_length / widest);
    for (const int factor : {2, 3, 4, 5}) {
        const double eta = factor;
        same_shape.push_back(
            {1 - 1 / (eta * eta),
             bending_of_shape(shape, widest * factor, wire_length / (widest * factor)) / base_shape - 1});
    }
    p.same_shape = through_origin(same_shape).first;
    std::vector<double> last_bending, last_wall;
    for (const ResolutionCurve& curve : curves) {
        const Resolved& base = curve.points.front();
        for (const Resolved& point : curve.points) {
            if (point.eta == 1) continue;
            wall.push_back({1 - 1 / point.eta, (point.wall - base.wall) / base.energy()});
            if (point.eta <= 1.2) early.push_back({1 - 1 / point.eta, wall.back().second});
        }
        last_bending.push_back((curve.points.back().bending - base.bending) / base.energy());
        last_wall.push_back((curve.points.back().wall - base.wall) / base.energy());
    }
    std::tie(p.upsilon, p.linear) = through_origin(wall);
    p.slope = through_origin(early).first;
    p.bending_gain = quantiles(last_bending).median;
    p.wall_gain = quantiles(last_wall).median;
    return p;
}

void claim_parts(StudyResult& result, const EnergyParts& in_pieces, const EnergyParts& smooth) {
    const auto near = [](double a, double b, double factor) { return a > b / factor && a < b * factor; };
    FigureClaims equations(
        result, "Eqs. 6 to 8 and 16",
        "The energies of bending and of the wall by themselves, which the paper adds up in Eq. 40.");
    equations.published("Eq. 6 is Eq. 5 for small angles: largest relative difference, at η = 1 and 3", 0.0,
                        smooth.eq_6, smooth.eq_6 < 1e-4, "below 1e-4");
    equations.published(
        "Eqs. 7 and 8, of a wire that keeps its shape while it is divided more finely: ΔU_bend/U_bend over "
        "(1 − 1/η²), over Eq. 8's own value",
        1.0, smooth.same_shape / smooth.eq_8, near(smooth.same_shape, smooth.eq_8, 2), "within a factor of 2",
        fmt::format("{:.2g} for {:.2g}. Eq. 7 takes θ' = θ/η. Where curvature changes along the wire, the "
                    "angle between chords is its mean over two of them, which loses ⟨Δθ²⟩/(6⟨θ²⟩) = {:.2g}, "
                    "also of the order of λ².",
                    smooth.same_shape, smooth.eq_8, smooth.uneven));
    equations.published("Eq. 8: c2 is ⟨θ⁴⟩/(24⟨θ²⟩): the fitted c2 over Eq. 8's own value, smooth tube", 1.0,
                        smooth.fit.c2 / smooth.eq_8, near(smooth.fit.c2, smooth.eq_8, 2),
                        "within a factor of 2",
                        fmt::format("{:.2g} for {:.2g}. c2 also holds what Eq. 8 leaves out: change of "
                                    "curvature between joints, and a shape that changes as the wall hardens.",
                                    smooth.fit.c2, smooth.eq_8));
    equations.published(
        "Eq. 8: the energy of bending increases with η at rest: ΔU_bend/U at the finest, in pieces", "> 0",
        in_pieces.bending_gain, in_pieces.bending_gain > 0, "above 0");
    equations.published(
        "Eq. 16: ΔU_surf is linear in 1 − 1/η: rms about Υ(1 − 1/η), over its value at η = 3, smooth tube",
        0.0, smooth.linear, smooth.linear < 0.1, "below 0.1",
        fmt::format("In pieces, with the scatter, {:.2g}.", in_pieces.linear));
    equations.published(
        "Eq. 16': Υ is the slope at η = 1: Υ/U fitted over that of the first fifth, smooth tube", 1.0,
        smooth.upsilon / smooth.slope, near(smooth.upsilon, smooth.slope, 1.5), "within a factor of 1.5",
        "Joints come into contact and leave it as λ falls, which changes the slope from place to place.");
    equations.published(
        "Eq. 40: c1 is the wall's, Υ/U > 0: ΔU_surf/U at the finest, smooth tube", "> 0", smooth.wall_gain,
        smooth.wall_gain > 0, "above 0",
        fmt::format("The wall's own energy falls, by {:.4f} of U, and that of bending rises by {:.4f} (in "
                    "pieces {:.4f} and {:.4f}): the force on the wall is kept while its springs become more, "
                    "so that each is pressed in less. c1 is right for the sum alone.",
                    -smooth.wall_gain, smooth.bending_gain, -in_pieces.wall_gain, in_pieces.bending_gain));
    equations.add(
        ClaimKind::Extension, "c1 is the wall's share of the energy at η = 1: c1 over it, smooth tube", 1.0,
        smooth.fit.c1 / smooth.wall_fraction, near(smooth.fit.c1, smooth.wall_fraction, 2),
        "within a factor of 2",
        "With k fixed at a joint, ΔU = U_wall(1 − 1/η) to first order, which says how much of U the "
        "published wall holds.");
}

io::Plot energy_parts_plot(const EnergyParts& in_pieces, const EnergyParts& smooth) {
    return filled_plot("resolution_parts", 1000, 460,
                       {{"eq_8", in_pieces.eq_8}, {"upsilon", smooth.upsilon}});
}

}  // namespace studies

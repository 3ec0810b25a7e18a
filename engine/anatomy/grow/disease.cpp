#include "engine/anatomy/grow/disease.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/anatomy/grow/vessel_tree.h"
#include "engine/io/error.h"
#include "physics/geometry/maths.h"

namespace anatomy {
namespace {

/// From 1 in the middle to 0 at both ends of a stretch.
double bell(double from_middle, double half_length) {
    const double part = std::abs(from_middle) / half_length;
    return part >= 1 ? 0 : 0.5 * (1 + geometry::cos(std::numbers::pi * part));
}

double smooth_step(double t) {
    t = std::clamp(t, 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

/// At every sample the direction across the branch that has this angle from the convex side at `at` [mm].
std::vector<Vec3> side(const SampledBranch& branch, double at, double angle) {
    std::vector<Vec3> across = branch.across();
    const int sample = branch.sample_at(at);
    const Vec3 wanted = branch.convex_side(sample), t = branch.tangent(sample), d = across[sample];
    const double turn = geometry::atan2(t.dot(d.cross(wanted)), d.dot(wanted)) + angle;
    for (int i = 0; i < static_cast<int>(across.size()); ++i)
        across[i] = geometry::rotation(turn, branch.tangent(i)) * across[i];
    return across;
}

}  // namespace

void narrow(SampledBranch& branch, const Stenosis& stenosis) {
    const std::vector<Vec3> plaque = side(branch, stenosis.at, stenosis.angle);
    for (int i = 0; i < static_cast<int>(branch.points.size()); ++i) {
        const double loss = stenosis.percent / 100 * branch.radii[i] *
                            bell(i * branch.step() - stenosis.at, stenosis.length / 2);
        branch.radii[i] -= loss;
        branch.points[i] -= stenosis.eccentricity * loss * plaque[i];
    }
}

void widen(SampledBranch& branch, const FusiformAneurysm& aneurysm) {
    for (int i = 0; i < static_cast<int>(branch.points.size()); ++i) {
        const double part = bell(i * branch.step() - aneurysm.at, aneurysm.length / 2);
        branch.radii[i] += part * std::max(0.0, aneurysm.diameter / 2 - branch.radii[i]);
    }
}

void occlude(SampledBranch& branch, const Occlusion& occlusion) {
    const int kept = std::max(4, branch.sample_at(occlusion.at)) + 1;
    if (kept >= static_cast<int>(branch.points.size())) return;
    branch.points.resize(kept);
    branch.radii.resize(kept);
    branch.closed = true;
    branch.joined = -1;
}

std::vector<CalciumDeposit> calcium_in(const SampledBranch& branch, const Stenosis& stenosis) {
    constexpr int strands = 7;    // side by side
    constexpr double arc = 130;   // of the wall, when eccentric [deg]
    constexpr double gap = 0.15;  // from the lumen as it was [mm]
    const std::vector<Vec3> plaque = side(branch, stenosis.at, stenosis.angle);
    const double spread = (stenosis.eccentricity > 0.3 ? arc : 300) * geometry::degree;
    std::vector<CalciumDeposit> deposits;
    for (int strand = 0; strand < strands; ++strand) {
        const double turn = spread * (strand / (strands - 1.0) - 0.5);
        // Uneven, as deposits are: each has its own stretch and thickness.
        const double uneven = std::abs(geometry::sin(12.9 * (strand + 1) + 0.7 * stenosis.at));
        const double half = stenosis.length / 2 * (0.5 + 0.4 * uneven),
                     middle = stenosis.at + 0.25 * stenosis.length * (uneven - 0.5);
        CalciumDeposit deposit;
        for (int i = 0; i < static_cast<int>(branch.points.size()); ++i) {
            const double from = i * branch.step() - middle;
            if (std::abs(from) > half) continue;
            const double wall = branch.radii[i];
            const double thick = std::clamp(0.4 * wall, 0.3, 1.8) * (0.6 + 0.6 * uneven);
            const double radius = thick * std::max(0.3, (1 - geometry::pow(from / half, 2)) *
                                                            (0.8 + 0.2 * geometry::sin(3 * from)));
            const Vec3 out = geometry::rotation(turn, branch.tangent(i)) * plaque[i];
            deposit.points.push_back(branch.points[i] + (wall + gap + thick) * out);
            deposit.radii.push_back(radius);
        }
        if (deposit.points.size() > 1) deposits.push_back(std::move(deposit));
    }
    return deposits;
}

BranchSpec sac(const Aneurysm& aneurysm, const SampledBranch& parent) {
    const int sample = parent.sample_at(aneurysm.at);
    const Vec3 out = geometry::rotation(aneurysm.angle, parent.tangent(sample)) * parent.convex_side(sample);
    const double sphere = aneurysm.diameter / 2, neck = aneurysm.neck / 2, wall = parent.radii[sample];
    const double centre = wall + std::sqrt(std::max(0.0, sphere * sphere - neck * neck));
    BranchSpec spec;
    spec.name = aneurysm.branch + " aneurysm";
    spec.parent = aneurysm.branch;
    spec.at = aneurysm.at;
    spec.closed = true;
    const double root = std::min(neck, 0.9 * wall);
    spec.knots = {{Vec3::Zero(), root}, {0.5 * wall * out, root}, {wall * out, neck}, {centre * out, sphere}};
    if (centre < wall + 0.2) spec.knots.erase(spec.knots.end() - 2);
    return spec;
}

BranchSpec dissect(SampledBranch& branch, const Dissection& dissection) {
    const std::vector<Vec3> towards_true = side(branch, dissection.at, dissection.angle);
    const int first = branch.sample_at(dissection.at),
              last = branch.sample_at(dissection.at + dissection.length);
    const double wide = *std::max_element(branch.radii.begin() + first, branch.radii.begin() + last + 1);
    const double ramp = 3 * wide;  // over which the two lumina part [mm]
    if (dissection.length < 2.5 * ramp) {
        throw io::InputError(
            "the dissection of '{}' is {:.4g} mm long; expected {:.0f} mm or more for a vessel with a radius "
            "of {:.1f} mm",
            branch.name, dissection.length, 2.5 * ramp, wide);
    }
    const double step = branch.step();
    const auto both = [&](int i) { return std::max(0.2, branch.radii[i] - dissection.flap / 2); };  // radii
    BranchSpec spec;
    spec.name = dissection.branch + " false lumen";
    spec.parent = spec.joins = dissection.branch;
    spec.at = dissection.at;
    spec.joins_at = dissection.at + dissection.length;
    const Vec3 origin = branch.points[first];
    const geometry::Polyline centre = branch.points;
    const std::vector<double> whole = branch.radii;
    for (int i = first; i <= last; ++i) {
        const double apart = smooth_step(std::min((i - first) * step, (last - i) * step) / ramp);
        const double of_true = dissection.true_fraction * both(i);
        branch.points[i] = centre[i] + apart * (whole[i] - of_true) * towards_true[i];
        branch.radii[i] = whole[i] + apart * (of_true - whole[i]);
    }
    const double spacing = std::max(3.0, 0.7 * wide);
    const int knots = std::max(8, static_cast<int>(dissection.length / spacing));
    for (int k = 0; k <= knots; ++k) {
        const int i = first + static_cast<int>(std::lround(static_cast<double>(last - first) * k / knots));
        const double apart = smooth_step(std::min((i - first) * step, (last - i) * step) / ramp);
        const double of_false = (1 - dissection.true_fraction) * (whole[i] - dissection.flap / 2);
        const Vec3 place = centre[i] - apart * (whole[i] - of_false) * towards_true[i];
        spec.knots.push_back({place - origin, 0.95 * of_false});
    }
    return spec;
}

}  // namespace anatomy

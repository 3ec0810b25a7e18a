#include "engine/studies/stability_cell.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/io/cpu_clock.h"
#include "engine/studies/slow_flow.h"
#include "physics/wire/energy.h"

namespace studies {
namespace {

using geometry::Vec3;
using physics::Chain;

void disturb(Chain& wire, const Disturbance& disturbance) {
    for (int k = 0; k < disturbance.inserted; ++k) physics::move(wire, wire.grid.segment_length);
    if (disturbance.turn != 0) physics::rotate(wire, physics::every_device, disturbance.turn);
}

/// Bends the wire slightly, far less than a wire that needs it would yield.
void bow(Chain& wire) {
    Vec3 side, other;
    geometry::tangent_basis(wire.tangents[0], side, other);
    const int n = wire.segments();
    for (int i = 1; i <= n; ++i)
        wire.tangents[i] =
            (wire.tangents[i] + 1e-4 * std::sin(M_PI * i / n) * (side + 0.6 * other)).normalized();
    physics::rebuild_joints(wire);
}

bool finite(const Chain& wire) {
    return std::all_of(wire.joints.begin(), wire.joints.end(), [](const Vec3& x) { return x.allFinite(); });
}

/// Relaxes by this many updates; returns false as soon as a number is not finite.
bool work(physics::Relaxer& relaxer, Chain& wire, long long updates, StabilityCell& cell, bool& at_rest) {
    const physics::RelaxBudget budget{static_cast<int>(std::max(1LL, updates)), 0.0, 0};
    const double start = io::thread_cpu_seconds();
    const physics::RelaxReport report = relaxer.relax(wire, budget);
    cell.cpu += io::thread_cpu_seconds() - start;
    cell.updates += report.updates;
    at_rest = report.converged();
    return finite(wire);
}

}  // namespace

std::string_view outcome_text(Outcome outcome) {
    constexpr std::array<std::string_view, outcomes> words = {
        "converged", "still moving", "oscillates", "wrong basin", "left the lumen", "NaN", "stuck"};
    return words[static_cast<std::size_t>(outcome)];
}

Outcome judge(const CellMeasure& m, const StabilityRules& rules) {
    if (!m.finite) return Outcome::NotANumber;
    if (m.penetration > std::max(rules.outside * m.room, rules.times_reference * m.reference_penetration))
        return Outcome::LeftTheLumen;
    if (m.gradient <= rules.gradient) {
        if (m.basin_deviation > rules.basin) return Outcome::WrongBasin;
        return m.deviation <= rules.basin ? Outcome::Converged : Outcome::StillMoving;
    }
    const std::size_t last_quarter = m.energies.size() - m.energies.size() / 4;
    for (std::size_t i = std::max<std::size_t>(1, last_quarter); i < m.energies.size(); ++i) {
        if (m.energies[i] > m.energies[i - 1] * (1 + rules.rise)) return Outcome::Oscillates;
    }
    return m.moved <= rules.stuck ? Outcome::Stuck : Outcome::StillMoving;
}

double largest_deviation(std::span<const Vec3> a, std::span<const Vec3> b, Symmetry symmetry) {
    if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
    const auto turned = [&](double angle, double mirror) {
        double farthest = 0;
        const double c = std::cos(angle), s = std::sin(angle);
        for (std::size_t i = 0; i < a.size(); ++i) {
            const double y = a[i].y(), z = mirror * a[i].z();
            const Vec3 moved(a[i].x(), c * y - s * z, s * y + c * z);
            farthest = std::max(farthest, (moved - b[i]).norm());
        }
        return farthest;
    };
    if (symmetry == Symmetry::None) return turned(0, 1);
    if (symmetry == Symmetry::MirrorZ) return std::min(turned(0, 1), turned(0, -1));
    double least = std::numeric_limits<double>::infinity();
    for (const double mirror : {1.0, -1.0}) {
        // The rotation that brings the joints nearest in the sum of squares.
        double along = 0, across = 0;
        for (std::size_t i = 0; i < a.size(); ++i) {
            const double y = a[i].y(), z = mirror * a[i].z();
            along += y * b[i].y() + z * b[i].z();
            across += y * b[i].z() - z * b[i].y();
        }
        least = std::min(least, turned(std::atan2(across, along), mirror));
    }
    return least;
}

StabilityReference find_reference(const BreakingCase& c) {
    Chain wire = c.start;
    SlowFlowReport report;
    const auto flow = [&] {
        if (c.bowed_reference) bow(wire);
        report = flow_to_rest(wire, *c.wall);
    };
    if (c.disturbances.empty()) flow();
    for (const Disturbance& disturbance : c.disturbances) {
        disturb(wire, disturbance);
        flow();
    }
    return {wire.joints, report.energy, report.gradient,
            physics::largest_penetration(physics::all_contacts(wire, *c.wall))};
}

StabilityCell run_cell(const BreakingCase& c, const StabilityReference& reference,
                       const physics::RelaxerConfig& config, const StabilityRules& rules) {
    StabilityCell cell;
    Chain wire = c.start;
    const auto relaxer = physics::make_relaxer(config, *c.wall);
    int segments = wire.segments();
    for (const Disturbance& d : c.disturbances) segments += d.inserted;
    const long long all = static_cast<long long>(c.cycles) * segments * (segments + 1) / 2;
    const auto steps = static_cast<long long>(c.disturbances.size());
    // Half of the work comes after the last disturbance, the other half in equal parts before it.
    const long long last = steps > 1 ? all / 2 : all;

    CellMeasure& m = cell.measure;
    m.reference_penetration = reference.penetration;
    bool at_rest = false;
    for (long long k = 0; k < steps && m.finite; ++k) {
        disturb(wire, c.disturbances[static_cast<std::size_t>(k)]);
        if (k + 1 < steps) m.finite = work(*relaxer, wire, (all - last) / (steps - 1), cell, at_rest);
    }
    at_rest = false;
    std::vector<Vec3> before_last_quarter;
    for (int k = 0; k < rules.samples && m.finite; ++k) {
        if (k == rules.samples - rules.samples / 4) before_last_quarter = wire.joints;
        if (!at_rest) m.finite = work(*relaxer, wire, last / rules.samples, cell, at_rest);
        m.energies.push_back(physics::total_energy(wire, physics::all_contacts(wire, *c.wall)).total());
    }
    if (m.finite) {
        const auto contacts = physics::all_contacts(wire, *c.wall);
        cell.energy = m.energies.back();
        m.finite = std::isfinite(cell.energy);
        m.gradient = physics::relative_gradient(wire, contacts);
        m.penetration = physics::largest_penetration(contacts);
        for (std::size_t i = 1; i < contacts.size(); ++i)
            if (contacts[i].penetration == m.penetration) m.room = contacts[i].room;
        m.moved = largest_deviation(wire.joints, before_last_quarter, Symmetry::None);
        m.deviation = largest_deviation(wire.joints, reference.joints, c.symmetry);
        flow_to_rest(wire, *c.wall);
        m.basin_deviation = largest_deviation(wire.joints, reference.joints, c.symmetry);
    }
    cell.outcome = judge(m, rules);
    return cell;
}

}  // namespace studies

#include "physics/relax/discretisation_error.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace physics {
namespace {

/// Pieces of a segment, and of each of the last ones where the tip touches: a wall is as stiff as the chain
/// that lies in it is long, so that its end sinks in by more the less of the chain its last joint stands for.
constexpr int pieces = 2, pieces_at_tip = 8, segments_at_tip = 4;
/// What the step leaves out: of halves a third of it, 1/(2² − 1), of eighths 1/63.
constexpr double left_by_halves = 4.0 / 3, left_at_tip = 7.0 / 6;
/// Differences of tips below this are the relaxer's tolerance [mm].
constexpr double least_error = 1e-6;
/// A pivot that is no more than this part of the stiffest joint is none.
constexpr double least_pivot_fraction = 1e-6;

bool bent_at_rest(const Chain& chain, int joint) {
    return std::any_of(chain.devices.begin(), chain.devices.end(),
                       [&](const Device& device) { return device.rest[joint].angle != 0; });
}

/// du/ds at a joint; at the end that of the joint before where a device is bent at rest there, else none.
Vec3 curvature(const Chain& chain, int joint) {
    const int n = chain.segments();
    assert(joint >= 0 && joint <= n);
    if (joint == n) {
        if (n < 2 || !bent_at_rest(chain, n - 1)) return Vec3::Zero();
        joint = n - 1;
    }
    return (chain.tangents[joint + 1] - chain.tangents[joint]) / chain.length_of(joint);
}

}  // namespace

void ErrorEstimator::cut(const Chain& chain, std::span<const WallContact> contacts) {
    const int n = chain.segments();
    parts_.assign(n + 1, pieces);
    parts_[0] = 0;
    if (contacts[n].touches())
        for (int i = std::max(1, n - segments_at_tip + 1); i <= n; ++i) parts_[i] = pieces_at_tip;
    std::size_t joints = 1;
    for (int i = 1; i <= n; ++i) joints += parts_[i];
    fine_.grid = {chain.grid.segment_length, EndCells::Half};
    fine_.devices = chain.devices;
    fine_.base_director = chain.base_director;
    fine_.load = chain.load;
    fine_.leading = chain.leading;
    fine_.tip_segments = chain.tip_segments;
    fine_.vessels_stay = chain.vessels_stay;
    fine_.joints.resize(joints);
    fine_.tangents.resize(joints);
    fine_.lengths.resize(joints);
    fine_.stations.resize(joints);
    near_.resize(joints);
}

/// Lets the curvature grow evenly along each segment from that of the joint before it to that of the one
/// after it, so that its pieces have the segment's direction in the mean.
void ErrorEstimator::lay(const Chain& chain) {
    fine_.joints[0] = chain.joints[0];
    fine_.tangents[0] = chain.tangents[0];
    fine_.lengths[0] = 0;
    fine_.stations[0] = chain.stations[0];
    near_[0] = 0;
    int k = 0;
    Vec3 before = curvature(chain, 0);
    for (int i = 1; i <= chain.segments(); ++i) {
        const Vec3 after = curvature(chain, i), &u = chain.tangents[i];
        const int parts = parts_[i];
        const double length = chain.lengths[i] / parts;
        for (int q = 0; q < parts; ++q) {
            const double s = (q + 0.5) / parts;
            Vec3 turn = chain.lengths[i] *
                        ((s - 0.5) * before +
                         (0.5 * s * s - 1.0 / 6 + 1.0 / (24.0 * parts * parts)) * (after - before));
            turn -= turn.dot(u) * u;
            ++k;
            fine_.lengths[k] = length;
            fine_.tangents[k] = (u + turn).normalized();
            fine_.joints[k] = fine_.joints[k - 1] + length * fine_.tangents[k];
            near_[k] = 2 * (q + 1) < parts ? i - 1 : i;
            fine_.stations[k] = chain.stations[near_[k]];
        }
        before = after;
    }
    for (std::size_t d = 0; d < chain.devices.size(); ++d) {
        const std::vector<double>& wound = chain.devices[d].wound;
        if (wound.empty()) continue;
        std::vector<double>& fine = fine_.devices[d].wound;
        fine.resize(fine_.joints.size());
        fine[0] = wound[0];
        k = 0;
        for (int i = 1; i <= chain.segments(); ++i)
            for (int q = 1; q <= parts_[i]; ++q)
                fine[++k] = wound[i - 1] + (wound[i] - wound[i - 1]) * q / parts_[i];
    }
}

/// Grips hold per length what those of the chain do, stretched as these are.
void ErrorEstimator::place_grips(const Chain& chain) {
    fine_.grips.assign(chain.grips.empty() ? 0 : fine_.joints.size(), {});
    if (chain.grips.empty()) return;
    const auto mixed = [](const auto& a, const auto& b, double s) { return a + s * (b - a); };
    int k = 0;
    fine_.grips[0] = chain.grips[0];
    for (int i = 1; i <= chain.segments(); ++i) {
        const Grip &a = chain.grips[i - 1], &b = chain.grips[i];
        const double la = chain.length_of(i - 1), lb = chain.length_of(i);
        for (int q = 1; q <= parts_[i]; ++q) {
            const double s = static_cast<double>(q) / parts_[i], here = fine_.length_of(++k);
            Grip& grip = fine_.grips[k] = s < 0.5 ? a : b;
            grip.force = here * (a.holds() && b.holds() ? mixed(a.force / la, b.force / lb, s)
                                 : q == parts_[i]       ? b.force / lb
                                                        : 0.0);
            grip.anchor = fine_.joints[k] +
                          mixed(Vec3(a.anchor - chain.joints[i - 1]), Vec3(b.anchor - chain.joints[i]), s);
            grip.roll = mixed(a.roll, b.roll, s);
            // The way of the vessel for the same force per length.
            grip.give = mixed(a.give * la, b.give * lb, s) / here;
            grip.given = mixed(a.given, b.given, s);
            grip.shift = mixed(a.shift, b.shift, s);
        }
    }
}

/// What touches at rest goes on to touch, with its force: without it a joint that hardly touches would let
/// the first step lead far away.
void ErrorEstimator::share_forces(const Chain& chain, std::span<const WallContact> contacts) {
    forces_.assign(fine_.joints.size(), 0.0);
    const int n = chain.segments();
    int k = 0;
    double before = 0;  // of the joint before, per length [N/mm]
    for (int i = 1; i <= n; ++i) {
        const double after = contacts[i].force() / chain.length_of(i);
        for (int q = 1; q <= parts_[i]; ++q) {
            const double s = static_cast<double>(q) / parts_[i];
            ++k;
            if (q == parts_[i] || (before > 0 && after > 0))
                forces_[k] = fine_.length_of(k) * (before + s * (after - before));
        }
        forces_[k] = fine_.length_of(k) * after;
        before = after;
    }
    forces_[k] = contacts[n].force();
}

std::optional<DiscretisationError> ErrorEstimator::of(const Chain& chain,
                                                      std::span<const WallContact> contacts,
                                                      bool by_segment) {
    const int n = chain.segments();
    if (n < 2 || contacts.size() != chain.joints.size()) return {};
    cut(chain, contacts);
    lay(chain);
    place_grips(chain);
    assign(fine_);
    contacts_.reset_near(fine_, near_, contacts, chain.joints);
    share_forces(chain, contacts);
    model_.directors.clear();
    if (fine_.bent_segments() > 0) {
        model_.directors.resize(fine_.joints.size());
        model_.directors[0] = fine_.base_director;
    }
    double stiffest = 0;
    for (int j = 0; j < fine_.segments(); ++j) stiffest = std::max(stiffest, fine_.spring_constant(j));
    model_.least_pivot = least_pivot_fraction * stiffest;
    model_.slips_on = 0.5;
    model_.start_with(fine_, forces_);
    if (model_.linearise(fine_, contacts_, 1, 0).shifted > 0) return {};
    if (!std::isfinite(model_.roll_out(fine_))) return {};
    model_.ask_trial(contacts_);
    model_.take_trial_contacts(fine_, contacts_);
    model_.solve(fine_, 0);
    if (!std::isfinite(model_.roll_out(fine_))) return {};
    model_.predict_contact_forces(fine_);
    DiscretisationError error;
    const double scale = contacts[n].touches() ? left_at_tip : left_by_halves;
    error.tip_moves = scale * (model_.trial_tip() - chain.tip());
    error.tip = std::max(least_error, error.tip_moves.norm());
    error.wall_force = scale * change_of_force(chain, contacts);
    (void)by_segment;
    return error;
}

/// Of the largest force on a length λ, by the model's forces on the finer chain.
double ErrorEstimator::change_of_force(const Chain& chain, std::span<const WallContact> contacts) const {
    double is = 0, would_be = 0;
    double before = 0;  // of the joint before the segment [N]
    int k = 0;
    for (int i = 1; i <= chain.segments(); ++i) {
        double after = 0;
        for (int q = 1; q <= parts_[i]; ++q) {
            const double s = static_cast<double>(q) / parts_[i], force = model_.planes()[++k].force;
            before += (1 - s) * force;
            after += s * force;
        }
        is = std::max(is, contacts[i].force());
        if (i > 1) would_be = std::max(would_be, before);
        before = after;
    }
    would_be = std::max(would_be, before);
    return would_be - is;
}

}  // namespace physics

#include "physics/relax/discretisation_error.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace physics {
namespace {

/// Pieces of a segment that is halved, and of one where a contact begins or ends or the tip touches. A wall
/// is as stiff as the chain that lies in it is long, so that an end, and a contact that one joint bears,
/// sinks in by more the less of the chain its joint stands for: halves show only a small part of it.
constexpr int halves = 2, finest = 8, finest_at_tip = 2;
/// The last piece of a tip that touches is halved so often, each time the distal half: an end that presses at
/// an angle goes on to sink in until pieces are as short as what lies in the wall.
constexpr int halvings_of_tip = 2;
/// None is shorter than this part of λ, but for halves.
constexpr double shortest = 1.0 / 32;
/// The wall is corrected at the place that the step leads to until the change of the largest force settles to
/// this part of it, and for an end that presses until the tip moves by no more than this part of the
/// estimate, too: one after another of the finer chain's joints comes to bear a part of what the last one
/// did.
constexpr int most_corrections = 6;
constexpr double settled = 0.01, settled_force = 0.5;
/// Segments that stay whole: farther from the tip than this, free, and bent at both ends by less than the
/// least of this angle [rad] and a part of the largest bend.
constexpr int near_tip = 12;
constexpr double least_bend = 0.02, part_of_largest = 0.1;
/// What the step leaves out: of halves a third of it, 1/(2² − 1), of eighths 1/63. Where the tip touches,
/// most of its error is there.
constexpr double left_by_halves = 4.0 / 3, left_at_tip = 1.05;
/// The step does not know the largest force better than to this part of it: a smaller change says only that
/// larger ones cancel.
constexpr double least_part_of_force = 0.01;
/// Differences below these are the relaxer's tolerance [mm], [N].
constexpr double least_error = 1e-6, least_change = 1e-6;
/// A pivot that is no more than this part of the stiffest joint is none.
constexpr double least_pivot_fraction = 1e-6;

bool bent_at_rest(const Chain& chain, int joint) {
    return std::any_of(chain.devices.begin(), chain.devices.end(),
                       [&](const Device& device) { return device.rest[joint].angle != 0; });
}

/// A vessel that gives way takes up what the end presses on it.
bool end_presses(std::span<const WallContact> contacts) {
    return contacts.back().touches() && contacts.back().give == 0;
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
    parts_.assign(n + 1, halves);
    parts_[0] = 0;
    const auto touches = [&](int joint) { return joint > 0 && contacts[joint].touches(); };
    const auto bend = [&](int joint) {
        return joint < n ? (chain.tangents[joint + 1] - chain.tangents[joint]).norm() : 0.0;
    };
    double largest = 0;
    for (int j = 0; j < n; ++j) largest = std::max(largest, bend(j));
    const double bent = std::min(least_bend, part_of_largest * largest);
    for (int i = 1; i <= n; ++i) {
        if (touches(i - 1) != touches(i))
            parts_[i] = finest;
        else if (i <= n - near_tip && !touches(i) && std::max(bend(i - 1), bend(i)) < bent)
            parts_[i] = 1;
    }
    if (end_presses(contacts))
        for (int i = std::max(1, n - finest_at_tip + 1); i <= n; ++i) parts_[i] = finest;
    const double least = shortest * chain.grid.segment_length * (1 - 1e-6);
    for (int i = 1; i <= n; ++i)
        while (parts_[i] > halves && chain.lengths[i] < least * parts_[i]) parts_[i] /= 2;
    place_.assign(1, 1.0);
    for (int i = 1; i <= n; ++i)
        for (int q = 1; q <= parts_[i]; ++q) place_.push_back(static_cast<double>(q) / parts_[i]);
    if (end_presses(contacts)) {
        double piece = 1.0 / parts_[n];
        place_.pop_back();
        for (int k = 0; k < halvings_of_tip && chain.lengths[n] * piece > 2 * least; ++k) {
            place_.push_back(1 - (piece *= 0.5));
            ++parts_[n];
        }
        place_.push_back(1.0);
    }
    const std::size_t joints = place_.size();
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
        double from = 0;
        for (int q = 0; q < parts_[i]; ++q) {
            const double to = place_[++k];
            // Of the piece, s − ½ and ½s² − 1/6 in the mean.
            Vec3 turn = chain.lengths[i] * ((0.5 * (from + to) - 0.5) * before +
                                            ((from * from + from * to + to * to - 1) / 6) * (after - before));
            turn -= turn.dot(u) * u;
            fine_.lengths[k] = (to - from) * chain.lengths[i];
            fine_.tangents[k] = (u + turn).normalized();
            fine_.joints[k] = fine_.joints[k - 1] + fine_.lengths[k] * fine_.tangents[k];
            near_[k] = 2 * to < 1 ? i - 1 : i;
            from = to;
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
                ++k, fine[k] = wound[i - 1] + (wound[i] - wound[i - 1]) * place_[k];
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
            const double s = place_[++k], here = fine_.length_of(k);
            Grip& grip = fine_.grips[k] = s < 0.5 ? a : b;
            grip.force = here * (a.holds() && b.holds() ? mixed(a.force / la, b.force / lb, s)
                                 : q == parts_[i]       ? b.force / lb
                                                        : 0.0);
            grip.anchor = fine_.joints[k] +
                          mixed(Vec3(a.anchor - chain.joints[i - 1]), Vec3(b.anchor - chain.joints[i]), s);
            grip.roll = mixed(a.roll, b.roll, s);
            // A joint that presses alone goes on to do so; others share what they press.
            const bool alone = q == parts_[i] && a.given.isZero(0) &&
                               (i == chain.segments() || chain.grips[i + 1].given.isZero(0));
            grip.give = alone ? b.give : mixed(a.give * la, b.give * lb, s) / here;
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
            const double s = place_[++k];
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
    if (n < 2 || contacts.size() != chain.joints.size() || !chain.tip().allFinite()) return {};
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
    passes_ = 1;
    if (model_.linearise(fine_, contacts_, 1, 0).shifted > 0) return {};
    double room = 0;
    for (const WallContact& c : contacts) room = std::max(room, c.clearance);
    // A step that leads farther than the lumen is wide says nothing, nor does one that is not finite.
    const auto leads_on = [&] {
        const double farthest = model_.roll_out(fine_);
        return std::isfinite(farthest) && !(room > 0 && farthest > room);
    };
    DiscretisationError error;
    if (!std::isfinite(model_.roll_out(fine_))) return {};
    if (by_segment) error.segments = parts_of(chain);
    const bool presses = end_presses(contacts);
    model_.predict_contact_forces(fine_);
    ForceChange force = change_of_force(chain, contacts);
    Vec3 tip = model_.trial_tip();
    for (int made = 0; made < most_corrections; ++made) {
        model_.ask_trial(contacts_);
        model_.take_trial_contacts(fine_, contacts_);
        model_.solve(fine_, 0);
        ++passes_;
        if (!leads_on()) {
            // Where the end is free the correction before is kept.
            if (made == 0 || presses) return {};
            break;
        }
        model_.predict_contact_forces(fine_);
        const double by = force.change;
        force = change_of_force(chain, contacts);
        const double moved = (model_.trial_tip() - tip).norm(), grown = std::abs(force.change - by);
        tip = model_.trial_tip();
        const bool tip_stays =
            !presses || moved < least_error || moved <= settled * (tip - chain.tip()).norm();
        if (tip_stays && (grown < least_change || grown <= settled_force * std::abs(force.change))) break;
    }
    const double scale = contacts[n].touches() ? left_at_tip : left_by_halves;
    error.tip_moves = scale * (tip - chain.tip());
    error.tip = std::max(least_error, error.tip_moves.norm());
    error.wall_force = std::copysign(
        std::max(left_by_halves * std::abs(force.change), least_part_of_force * force.largest), force.change);
    if (!std::isfinite(error.wall_force)) return {};
    // They are of the step without the correction, and follow the whole.
    double sum = 0;
    for (const double part : error.segments) sum += part;
    for (double& part : error.segments) part *= sum > 0 ? error.tip / sum : 0.0;
    return error;
}

/// g·w by segment, with the gradient g at the finer chain as it is laid and its answer w to a force on the
/// tip, in the direction in which the step moves that; before its wall is corrected.
std::vector<double> ErrorEstimator::parts_of(const Chain& chain) {
    std::vector<double> parts(chain.joints.size(), 0.0);
    Vec3 along = model_.trial_tip() - fine_.tip();
    const Vec3 laid = fine_.tip() - chain.tip();
    const Vec3 whole = along + laid;
    if (!(whole.norm() > 0)) return parts;
    along = whole.normalized();
    const std::vector<double> of_step = model_.parts_along(fine_, along);
    int k = 0;
    for (int i = 1; i <= chain.segments(); ++i) {
        Vec3 across = Vec3::Zero();
        for (int q = 1; q <= parts_[i]; ++q) {
            parts[i] += of_step[++k];
            across += fine_.lengths[k] * fine_.tangents[k];
        }
        // What the curve between its ends is shorter across.
        parts[i] += along.dot(across - chain.lengths[i] * chain.tangents[i]);
    }
    return parts;
}

/// Of the largest force on a length λ, by the model's forces on the finer chain.
ErrorEstimator::ForceChange ErrorEstimator::change_of_force(const Chain& chain,
                                                            std::span<const WallContact> contacts) const {
    double is = 0, would_be = 0;
    double before = 0;  // of the joint before the segment [N]
    int k = 0;
    for (int i = 1; i <= chain.segments(); ++i) {
        double after = 0;
        for (int q = 1; q <= parts_[i]; ++q) {
            const double s = place_[++k], force = model_.planes()[k].force;
            before += (1 - s) * force;
            after += s * force;
        }
        is = std::max(is, contacts[i].force());
        if (i > 1) would_be = std::max(would_be, before);
        before = after;
    }
    would_be = std::max(would_be, before);
    return {would_be - is, is};
}

}  // namespace physics

#include "physics/relax/stored_planes.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace physics {
namespace {

constexpr double reach_limit = 0.1;  // of the narrowest room that a joint has: how far planes are good for
/// Fraction of 1/ρ for a wall of planes. Its normal jumps from facet to facet, and a wire would swing across
/// them from sweep to sweep; with 4 it bounces no higher than when every update asks.
constexpr double round_fraction = 4;
constexpr double still = 1e-9;  // a joint that moved less keeps its plane [mm]

}  // namespace

void StoredPlanes::Plane::see() {
    up = hoop.dot(moved);
    depth = penetration + normal.dot(moved) + 0.5 * up * up;
    k = stiffness + stiffening.dot(moved);
}

void StoredPlanes::reset(const Chain& wire) {
    contacts_.clear();
    load_.weigh(wire);
    ask(wire, 1);
    assert(contacts_.size() == wire.joints.size() && listed_from_ == 1);
}

void StoredPlanes::ask(const Chain& wire, int first) {
    assert(first >= 1 && wire.stations.size() == wire.joints.size());
    const bool anew = contacts_.size() != wire.joints.size();
    if (anew) {
        contacts_.assign(wire.joints.size(), {});
        asked_at_.resize(wire.joints.size());
        waiting_.assign(wire.joints.size() + 1, Vec3::Zero());
        for (std::size_t i = 0; i < contacts_.size(); ++i) contacts_[i].station = wire.stations[i];
    }
    if (!anew) reach_ = reach();
    index_.clear();
    at_.clear();
    answer_.clear();
    for (int i = first; i <= wire.segments(); ++i) {
        if (!anew) {
            const double moved = (wire.joints[i] - asked_at_[i]).norm();
            if (moved <= still || contacts_[i].trust - moved >= reach_) continue;
        }
        index_.push_back(i);
        at_.push_back(wire.joints[i]);
        answer_.push_back(contacts_[i]);
        answer_.back().fraction = wire.wall_fraction(i);
    }
    wall_.contacts(at_, answer_);
    queries_ += static_cast<long long>(at_.size());
    for (std::size_t k = 0; k < index_.size(); ++k) {
        WallContact& c = contacts_[index_[k]];
        c = answer_[k];
        asked_at_[index_[k]] = at_[k];
    }
    if (anew) reach_ = reach();
    list(wire, first);
}

double StoredPlanes::reach() const {
    assert(!contacts_.empty());
    double room = std::numeric_limits<double>::max();
    for (const WallContact& c : contacts_)
        if (c.clearance > 0) room = std::min(room, c.clearance);
    assert(room > 0);
    return reach_limit * room;
}

void StoredPlanes::list(const Chain& wire, int first) {
    assert(first >= 1 && contacts_.size() == wire.joints.size());
    const int n = wire.segments();
    const auto from = std::lower_bound(planes_.begin(), planes_.end(), first,
                                       [](const Plane& p, int joint) { return p.joint < joint; });
    planes_.erase(from, planes_.end());
    first_plane_.resize(n + 2);
    for (int i = first; i <= n; ++i) {
        first_plane_[i] = static_cast<int>(planes_.size());
        const double moved = (wire.joints[i] - asked_at_[i]).norm();
        if (contacts_[i].trust - moved < reach_) planes_.push_back(plane_of(wire, i));
    }
    first_plane_[n + 1] = static_cast<int>(planes_.size());
    assert(first_plane_[n + 1] <= n && first_plane_[first] <= first_plane_[n + 1]);
    listed_from_ = front_ = first;
    shift_ = tail_ = Vec3::Zero();
    travelled_ = farthest_ = 0;
    sum_up(first_plane_[first]);
}

StoredPlanes::Plane StoredPlanes::plane_of(const Chain& wire, int joint) const {
    assert(joint >= 1 && joint <= wire.segments());
    const WallContact& c = contacts_[joint];
    Plane p;
    p.joint = joint;
    p.penetration = c.penetration;
    p.stiffness = c.stiffness;
    p.normal = c.normal;
    p.stiffening = c.stiffening;
    p.moved = wire.joints[joint] - asked_at_[joint];
    // The wire runs roughly along its vessel; where it meets the wall head-on no direction round it exists.
    const Vec3 round = c.normal.cross(wire.tangents[joint]);
    const double sine = round.norm();
    if (sine > 0.1) {
        const Vec3 hoop = round / sine;
        const double bent = c.curvature.isZero(0)
                                ? round_fraction / std::max(c.clearance + c.penetration, 0.1 * c.clearance)
                                : std::max(0.0, hoop.dot(c.curvature * hoop));
        p.hoop = std::sqrt(bent) * hoop;
    }
    p.see();
    return p;
}

void StoredPlanes::start_sweep(Chain& wire, int first) {
    settle_all(wire);
    rebuild_joints(wire);
    ask(wire, first);
    assert(front_ == first && listed_from_ == first && waiting_length_ == 0);
}

void StoredPlanes::settle(Chain& wire, int segment) {
    assert(segment >= 1 && segment <= wire.segments());
    if (segment < front_) {
        settle_all(wire);
        travelled_ += farthest_;
        farthest_ = 0;
        tail_.setZero();
        front_ = segment;
        if (segment >= listed_from_) sum_up(first_plane_[segment]);
    }
    for (; front_ < segment; ++front_) {
        Vec3& waiting = waiting_[front_];
        if (!waiting.isZero(0)) {
            shift_ += waiting;
            tail_ += waiting;
            waiting_length_ -= waiting.norm();
            waiting.setZero();
        }
        wire.joints[front_] += shift_;
    }
    farthest_ = std::max(farthest_, tail_.norm() + waiting_length_);
    // Half, so that the update to come stays within reach.
    if (segment < listed_from_ || 2 * travel() > reach_) {
        settle_all(wire);
        ask(wire, segment);
    }
    assert(front_ == segment && listed_from_ <= segment);
}

void StoredPlanes::settle_all(Chain& wire) {
    assert(waiting_.size() == wire.joints.size() + 1);
    const int n = wire.segments();
    farthest_ = std::max(farthest_, tail_.norm() + waiting_length_);
    for (; front_ <= n; ++front_) {
        shift_ += waiting_[front_];
        waiting_[front_].setZero();
        wire.joints[front_] += shift_;
    }
    shift_.setZero();
    waiting_length_ = 0;
}

const Chain& StoredPlanes::settled(const Chain& wire) {
    assert(waiting_.size() == wire.joints.size() + 1 && front_ >= 1);
    settled_ = wire;
    Vec3 shift = shift_;
    for (int i = front_; i <= wire.segments(); ++i) settled_.joints[i] += shift += waiting_[i];
    return settled_;
}

double StoredPlanes::energy(const Chain&, int first, int) const {
    assert(first >= listed_from_);
    double energy = 0;
    for (std::size_t k = first_plane_[first]; k < planes_.size(); ++k) energy += planes_[k].energy();
    return energy;
}

double StoredPlanes::move(Chain&, std::span<const TailStep> steps, int) {
    assert(!steps.empty() && steps.front().joint >= listed_from_);
    assert(std::is_sorted(steps.begin(), steps.end(),
                          [](const TailStep& a, const TailStep& b) { return a.joint < b.joint; }));
    steps_.assign(steps.begin(), steps.end());
    trial_.assign(planes_.begin() + first_plane_[steps.front().joint], planes_.end());
    double energy = 0;
    Vec3 shift = Vec3::Zero();
    auto step = steps.begin();
    for (Plane& p : trial_) {
        for (; step != steps.end() && step->joint <= p.joint; ++step) shift += step->by;
        p.moved += shift;
        p.see();
        energy += p.energy();
    }
    if (!load_.none())
        for (const TailStep& s : steps) energy -= load_.from(s.joint).dot(s.by);
    return energy;
}

void StoredPlanes::commit() {
    assert(trial_.size() <= planes_.size());
    const int first = static_cast<int>(planes_.size() - trial_.size());
    std::copy(trial_.begin(), trial_.end(), planes_.begin() + first);
    for (const TailStep& step : steps_) {
        Vec3& waiting = waiting_[step.joint];
        waiting_length_ -= waiting.norm();
        waiting += step.by;
        waiting_length_ += waiting.norm();
    }
    assert(!(waiting_length_ < -1e-9));
    sum_up(first);
}

void StoredPlanes::sum_up(int first_plane) {
    assert(first_plane >= 0 && first_plane <= static_cast<int>(planes_.size()));
    sums_.resize(planes_.size() + 1);
    PushSum sum;
    sums_.back() = sum;
    last_touching_ = -1;
    for (int k = static_cast<int>(planes_.size()) - 1; k >= first_plane; --k) {
        const Plane& p = planes_[k];
        if (p.depth > 0) {
            const Vec3 slope = p.normal + p.up * p.hoop;
            const double force = p.k * p.depth;
            sum.force += force * slope + 0.5 * p.depth * p.depth * p.stiffening;
            sum.stiffness += p.k * slope * slope.transpose() + force * p.hoop * p.hoop.transpose();
            last_touching_ = std::max(last_touching_, p.joint);
        }
        sums_[k] = sum;
    }
}

int StoredPlanes::touching() const {
    assert(planes_.size() < contacts_.size());
    return static_cast<int>(
        std::count_if(planes_.begin(), planes_.end(), [](const Plane& p) { return p.depth > 0; }));
}

PushSum StoredPlanes::sum_from(int joint) const {
    assert(joint >= listed_from_ && sums_.size() == planes_.size() + 1);
    PushSum sum = sums_[first_plane_[joint]];
    sum.force -= load_.from(joint);
    return sum;
}

}  // namespace physics

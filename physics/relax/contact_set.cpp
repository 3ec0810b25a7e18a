#include "physics/relax/contact_set.h"

#include <algorithm>
#include <cassert>
#include <functional>

namespace physics {
namespace {

constexpr double deeper = 1e-6;  // in another vessel's lumen, for a joint to change over to it [mm]

}  // namespace

void ContactSet::forget() {
    contacts_.clear();
    touching_.clear();
    sums_.clear();
}

void ContactSet::reset(const Chain& wire) {
    forget();
    update(wire);
    assert(contacts_.size() == wire.joints.size());
}

void ContactSet::reset_near(const Chain& wire, std::span<const int> near,
                            std::span<const WallContact> contacts, std::span<const Vec3> at) {
    assert(near.size() == wire.joints.size() && contacts.size() == at.size());
    forget();
    release();
    refit(wire);
    contacts_.resize(near.size());
    asked_at_.resize(near.size());
    for (std::size_t i = 0; i < near.size(); ++i) {
        contacts_[i] = contacts[near[i]];
        contacts_[i].fraction = fractions_[i];
        asked_at_[i] = at[near[i]];
    }
    begin();
    for (int i = 1; i <= wire.segments(); ++i)
        if (!known(i, wire.joints[i])) add(i, wire.joints[i], wire.stations[i], vessels_[i].given);
    ask();
    commit();
    list_touching(1);
    load_.weigh(wire);
}

void ContactSet::update(const Chain& wire) {
    const std::size_t before = contacts_.size();
    contacts_.resize(wire.joints.size());
    asked_at_.resize(wire.joints.size(), Vec3::Zero());
    refit(wire);
    begin();
    for (int i = 1; i <= wire.segments(); ++i) {
        const Vec3& x = wire.joints[i];
        const bool asked = static_cast<std::size_t>(i) < before && wire.stations[i] == contacts_[i].station &&
                           fractions_[i] == contacts_[i].fraction &&
                           thickness_[i] == contacts_[i].thickness && vessels_[i].give == contacts_[i].give &&
                           vessels_[i].along == contacts_[i].along && vessels_[i].shift == contacts_[i].shift;
        if (asked && (x == asked_at_[i] || known(i, x))) continue;
        add(i, x, wire.stations[i], x == asked_at_[i] ? contacts_[i].given : vessels_[i].given);
    }
    ask();
    std::erase_if(touching_, [&](int i) { return i > wire.segments(); });
    sums_.clear();
    commit();
    load_.weigh(wire);
    assert(touching_.empty() || touching_.back() <= wire.segments());
}

void ContactSet::refit(const Chain& wire) {
    assert(wire.thickness.size() == wire.joints.size());
    thickness_ = wire.thickness;
    fractions_.resize(wire.joints.size());
    vessels_.resize(wire.joints.size());
    for (int i = 1; i <= wire.segments(); ++i) {
        fractions_[i] = wire.wall_fraction(i);
        wire.ask_vessel(i, vessels_[i]);
    }
}

void CarriedLoad::weigh(const Chain& wire) {
    assert(wire.load.allFinite());
    load_ = wire.load;
    carried_.clear();
    if (load_.isZero(0)) return;
    carried_.assign(wire.joints.size() + 1, 0.0);
    for (int i = wire.segments(); i >= 1; --i) carried_[i] = carried_[i + 1] + wire.length_of(i);
    assert(carried_[1] > 0 && carried_[wire.segments() + 1] == 0);
}

double CarriedLoad::energy(std::span<const Vec3> joints, int first, int last) const {
    assert(first >= 1 && (none() || carried_.size() == joints.size() + 1));
    if (none()) return 0;
    Vec3 moved = Vec3::Zero();
    const int end = std::min(last + 1, static_cast<int>(joints.size()) - 1);
    for (int i = first; i <= end; ++i) moved += carried_[i] * (joints[i] - joints[i - 1]);
    return -load_.dot(moved);
}

void ContactSet::begin() {
    index_.clear();
    at_.clear();
    answer_.clear();
}

void ContactSet::add(int joint, const Vec3& x, int station, const Vec3& given) {
    assert(joint >= 1 && joint < static_cast<int>(contacts_.size()));
    index_.push_back(joint);
    at_.push_back(x);
    WallContact& answer = answer_.emplace_back(question(joint, station));
    answer.given = given;
    answer.held = !held_.empty() && std::binary_search(held_.begin(), held_.end(), joint);
}

void ContactSet::ask() {
    assert(at_.size() == answer_.size() && index_.size() == answer_.size());
    wall_.contacts(at_, answer_);
    queries_ += static_cast<long long>(at_.size());
}

double ContactSet::evaluate(std::span<const Vec3> joints, int first, int last) {
    assert(first >= 1 && last < static_cast<int>(contacts_.size()));
    assert(joints.size() == contacts_.size() && fractions_.size() == contacts_.size());
    begin();
    for (int i = first; i <= last; ++i)
        if (const WallContact& c = contacts_[i]; !known(i, joints[i]))
            add(i, joints[i], c.station, c.touches() ? c.given_beside(joints[i] - asked_at_[i]) : c.given);
    ask();
    double energy = 0;
    for (const WallContact& c : answer_)
        if (c.touches()) energy += c.energy();
    return energy + load_.energy(joints, first, last);
}

KeptFields ContactSet::hold() {
    assert(std::is_sorted(held_.begin(), held_.end()) && index_.size() == answer_.size());
    KeptFields sum;
    for (std::size_t k = 0; k < index_.size(); ++k) {
        const int joint = index_[k];
        WallContact& now = answer_[k];
        const WallContact& before = contacts_[joint];
        if (now.held || !now.touches() || now.station == before.station) continue;
        const auto in_field_of = [&](int station, const Vec3& x) {
            return asked_from(station, joint, x, true);
        };
        if (std::binary_search(held_.begin(), held_.end(), joint)) {
            const WallContact there = in_field_of(now.station, asked_at_[joint]);
            const double was = before.touches() ? before.energy() : 0.0;
            if (there.touches()) sum.jump += std::max(0.0, there.energy() - was);
            continue;
        }
        const WallContact own = in_field_of(before.station, at_[k]);
        const double by = (own.touches() ? own.energy() : 0.0) - now.energy();
        if (!own.held || !(by < 0)) continue;
        sum.energy += by;
        assert(sum.energy <= 0);
        now = own;
        held_.insert(std::lower_bound(held_.begin(), held_.end(), joint), joint);
    }
    return sum;
}

void ContactSet::commit() {
    assert(std::is_sorted(index_.begin(), index_.end()) && asked_at_.size() == contacts_.size());
    for (std::size_t k = 0; k < index_.size(); ++k) {
        contacts_[index_[k]] = answer_[k];
        asked_at_[index_[k]] = at_[k];
    }
    if (!index_.empty()) list_touching(index_.front());
}

/// The touching joints proximal of `first` are as they were.
void ContactSet::list_touching(int first) {
    assert(first >= 1 && std::is_sorted(touching_.begin(), touching_.end()));
    touching_.erase(std::lower_bound(touching_.begin(), touching_.end(), first), touching_.end());
    for (int i = first; i < static_cast<int>(contacts_.size()); ++i)
        if (contacts_[i].touches()) touching_.push_back(i);
    assert(std::adjacent_find(touching_.begin(), touching_.end(), std::greater_equal()) == touching_.end());
    sums_.clear();
}

void ContactSet::sum_pushes() const {
    assert(touching_.empty() ||
           (touching_.front() >= 1 && touching_.back() < static_cast<int>(contacts_.size())));
    sums_.resize(touching_.size());
    PushSum sum;
    for (int k = static_cast<int>(touching_.size()) - 1; k >= 0; --k) {
        const WallContact& c = contacts_[touching_[k]];
        sum.force += c.push();
        sum.stiffness += c.stiffness * c.normal * c.normal.transpose();
        sums_[k] = sum;
    }
}

WallContact ContactSet::question(int joint, int station) const {
    WallContact c;
    c.station = station;
    c.thickness = thickness_[joint];
    c.fraction = fractions_[joint];
    c.give = vessels_[joint].give;
    c.along = vessels_[joint].along;
    c.shift = vessels_[joint].shift;
    c.given = contacts_[joint].given;
    return c;
}

WallContact ContactSet::asked_from(int station, int joint, const Vec3& x, bool held) {
    assert(joint >= 1 && joint < static_cast<int>(fractions_.size()));
    WallContact c = question(joint, station);
    c.held = held;
    wall_.contacts({&x, 1}, {&c, 1});
    ++queries_;
    return c;
}

bool ContactSet::rejoin_vessel(const Chain& wire, int joint, int neighbour) {
    assert(std::abs(joint - neighbour) == 1 && contacts_.size() == wire.joints.size());
    WallContact& own = contacts_[joint];
    const Vec3& x = wire.joints[joint];
    if (wall_.same_vessel(own.station, contacts_[neighbour].station)) return false;
    const bool touched = own.touches();
    if (!touched) {
        if (x == asked_at_[joint]) return false;
        own = asked_from(own.station, joint, x);
        asked_at_[joint] = x;
        if (!own.touches()) return false;
    }
    const WallContact other = asked_from(contacts_[neighbour].station, joint, x);
    if (other.station == own.station || !(other.penetration < own.penetration - deeper)) return !touched;
    own = other;
    return touched || own.touches();
}

int ContactSet::rejoin_vessels(const Chain& wire) {
    assert(contacts_.size() == wire.joints.size());
    const int count = static_cast<int>(contacts_.size());
    int first = count;
    for (int i = 2; i < count; ++i)
        if (rejoin_vessel(wire, i, i - 1)) first = std::min(first, i);
    for (int i = count - 2; i >= 1; --i)
        if (rejoin_vessel(wire, i, i + 1)) first = std::min(first, i);
    if (first == count) return -1;
    list_touching(first);
    return first;
}

double ContactSet::energy(std::span<const Vec3> joints, int first, int last) const {
    assert(joints.size() == contacts_.size() && first >= 1);
    double energy = 0;
    for (auto k = std::lower_bound(touching_.begin(), touching_.end(), first);
         k != touching_.end() && *k <= last; ++k)
        energy += contacts_[*k].energy();
    return energy + load_.energy(joints, first, last);
}

void ContactSet::start_sweep(Chain& wire, int) {
    assert(contacts_.size() == wire.joints.size());
    rebuild_joints(wire);
}

double ContactSet::move(Chain& wire, std::span<const TailStep> steps, int last) {
    assert(!steps.empty() && last <= wire.segments());
    first_moved_ = steps.front().joint;
    unmoved_.assign(wire.joints.begin() + first_moved_, wire.joints.begin() + last + 1);
    Vec3 shift = Vec3::Zero();
    auto step = steps.begin();
    for (int i = first_moved_; i <= last; ++i) {
        if (step != steps.end() && step->joint == i) shift += (step++)->by;
        wire.joints[i] += shift;
    }
    return evaluate(wire.joints, first_moved_, last);
}

void ContactSet::undo(Chain& wire) const {
    assert(first_moved_ + unmoved_.size() <= wire.joints.size());
    std::copy(unmoved_.begin(), unmoved_.end(), wire.joints.begin() + first_moved_);
}

PushSum ContactSet::sum_from(int joint) const {
    assert(joint >= 1 && joint <= static_cast<int>(contacts_.size()));
    if (sums_.size() != touching_.size()) sum_pushes();
    const auto k = std::lower_bound(touching_.begin(), touching_.end(), joint);
    PushSum sum = k == touching_.end() ? PushSum{} : sums_[k - touching_.begin()];
    sum.force -= load_.from(joint);
    return sum;
}

}  // namespace physics

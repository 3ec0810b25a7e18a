#include "physics/contact_set.h"

#include <algorithm>

namespace physics {

void ContactSet::reset(const Guidewire& wire) {
    const int n = wire.segments();
    contacts_.assign(n + 1, {});
    asked_at_ = wire.joints;
    shares_.resize(n + 1);
    for (int i = 1; i <= n; ++i) {
        contacts_[i].station = wire.stations[i];
        shares_[i] = wire.wall_share(i);
    }
    wall_.contacts(std::span(wire.joints).subspan(1), std::span(contacts_).subspan(1));
    for (int i = 1; i <= n; ++i) contacts_[i].stiffness *= shares_[i];
    queries_ += n;
    list_touching();
}

double ContactSet::evaluate(std::span<const Vec3> joints, int first) {
    index_.clear();
    at_.clear();
    answer_.clear();
    for (int i = first; i < static_cast<int>(joints.size()); ++i) {
        const WallContact& c = contacts_[i];
        if (!c.touches() && (joints[i] - asked_at_[i]).squaredNorm() < c.trust * c.trust) continue;
        index_.push_back(i);
        at_.push_back(joints[i]);
        answer_.emplace_back().station = c.station;
    }
    wall_.contacts(at_, answer_);
    queries_ += static_cast<long long>(at_.size());
    double energy = 0;
    for (std::size_t k = 0; k < answer_.size(); ++k) {
        WallContact& c = answer_[k];
        c.stiffness *= shares_[index_[k]];
        if (c.touches()) energy += c.energy();
    }
    return energy;
}

void ContactSet::commit() {
    for (std::size_t k = 0; k < index_.size(); ++k) {
        contacts_[index_[k]] = answer_[k];
        asked_at_[index_[k]] = at_[k];
    }
    list_touching();
}

void ContactSet::list_touching() {
    touching_.clear();
    for (int i = 1; i < static_cast<int>(contacts_.size()); ++i)
        if (contacts_[i].touches()) touching_.push_back(i);
    sums_.resize(touching_.size());
    WallSum sum;
    for (int k = static_cast<int>(touching_.size()) - 1; k >= 0; --k) {
        const WallContact& c = contacts_[touching_[k]];
        sum.force += c.push();
        sum.stiffness += c.stiffness * c.normal * c.normal.transpose();
        sums_[k] = sum;
    }
}

double ContactSet::energy(int first) const {
    double energy = 0;
    for (auto k = std::lower_bound(touching_.begin(), touching_.end(), first); k != touching_.end(); ++k)
        energy += contacts_[*k].energy();
    return energy;
}

WallSum ContactSet::sum_from(int joint) const {
    const auto k = std::lower_bound(touching_.begin(), touching_.end(), joint);
    return k == touching_.end() ? WallSum{} : sums_[k - touching_.begin()];
}

}  // namespace physics

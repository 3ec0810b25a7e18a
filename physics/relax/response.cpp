#include "physics/relax/response.h"

#include <algorithm>
#include <cassert>

#include "physics/wire/feed.h"

namespace physics {
namespace {

/// Of the amount asked for: gradients are differences over it, scaled up.
constexpr double small = 1e-6;

void scale(Moved& moved, double by) {
    for (Vec3& joint : moved.joints) joint *= by;
    for (double& force : moved.forces) force *= by;
}

/// Of a contact's force as its joint moves on the wall [N].
double grown(const WallContact& contact, const Vec3& by) {
    if (!contact.touches()) return 0;
    return contact.stiffness * contact.normal.dot(by) + contact.penetration * contact.stiffening.dot(by);
}

}  // namespace

double Moved::largest_force(std::span<const WallContact> contacts) const {
    assert(contacts.size() == forces.size());
    const auto largest = std::ranges::max_element(contacts, {}, &WallContact::force);
    return forces[static_cast<std::size_t>(largest - contacts.begin())];
}

Response::Response(const LumenWall& wall, const Chain& rest, Grips grips)
    : wall_(wall), rest_(rest), contacts_(wall) {
    // A force that stays is no part of a change of the gradient.
    if (grips == Grips::Slide)
        for (Grip& grip : rest_.grips) grip.force = 0;
    if (rest_.segments() < 2 || !rest_.tip().allFinite()) return;
    contacts_.reset(rest_);
    if (rest_.bent_segments() > 0) {
        model_.directors.resize(rest_.joints.size());
        model_.directors[0] = rest_.base_director;
    }
    double stiffest = 0;
    for (int j = 0; j < rest_.segments(); ++j) stiffest = std::max(stiffest, rest_.spring_constant(j));
    constexpr double pivot_fraction = 1e-6;
    model_.least_pivot = pivot_fraction * stiffest;
    std::vector<double> forces;
    for (const WallContact& contact : contacts_.contacts()) forces.push_back(contact.force());
    model_.start_with(rest_, forces);
    const RiccatiReport report = model_.linearise(rest_, contacts_, 1, 0);
    exists_ = report.shifted == 0;
    curve_ = report.curve;
}

double Response::torque_curve(int device) const {
    const int frame = model_.terms().frames.of[device];
    return exists_ && frame >= 0 ? curve_[frame][frame] : 0.0;
}

std::optional<Moved> Response::to(const Chain& changed) const {
    assert(changed.joints.size() == rest_.joints.size());
    if (!exists_) return {};
    ContactSet contacts(wall_);
    contacts.reset(changed);
    auto joints = model_.moved_by(rest_, changed, contacts);
    if (!joints) return {};
    Moved moved{std::move(*joints), std::vector<double>(rest_.joints.size(), 0.0)};
    for (std::size_t j = 1; j < moved.joints.size(); ++j) {
        const WallContact &before = contacts_.contacts()[j], &after = contacts.contacts()[j];
        if (before.touches())
            moved.forces[j] = grown(before, moved.joints[j]) + after.force() - before.force();
    }
    return moved;
}

/// `change` alters the chain by an amount.
template <class Change>
std::optional<Moved> Response::to_small(double amount, const Change& change) const {
    if (!exists_) return {};
    Chain changed = rest_;
    change(changed, small * amount);
    auto moved = to(changed);
    if (moved) scale(*moved, 1 / small);
    return moved;
}

std::optional<Moved> Response::to_rigidity(int device, double part) const {
    return to_small(part, [device](Chain& chain, double by) {
        for (StiffnessSection& section : chain.devices[device].spec.sections) {
            section.rigidity_distal *= 1 + by;
            section.rigidity_proximal *= 1 + by;
        }
        assign(chain);
    });
}

std::optional<Moved> Response::to_wall_stiffness(double part) const {
    // A joint's share of the wall is its length over λ.
    return to_small(part, [](Chain& chain, double by) { chain.grid.segment_length /= 1 + by; });
}

std::optional<Moved> Response::to_radius(double by) const {
    return to_small(by, [](Chain& chain, double more) {
        for (double& thickness : chain.thickness) thickness -= more;
    });
}

std::optional<Moved> Response::to_turn(int device, double angle) const {
    return to_small(angle, [device](Chain& chain, double by) { rotate(chain, device, by); });
}

std::optional<Moved> Response::to_moved_wall(std::span<const Vec3> by) const {
    assert(by.size() == rest_.joints.size());
    if (!exists_) return {};
    auto joints = model_.moved_with(rest_, by);
    if (!joints) return {};
    Moved moved{std::move(*joints), std::vector<double>(rest_.joints.size(), 0.0)};
    for (std::size_t j = 1; j < moved.joints.size(); ++j)
        moved.forces[j] = grown(contacts_.contacts()[j], moved.joints[j] - by[j]);
    return moved;
}

Response::OtherWall Response::to_mesh(const geometry::MeshQuery& mesh) const {
    OtherWall other;
    if (!exists_) return other;
    constexpr double step = 0.02;  // of differences, which smooth the mesh's edges [mm]
    std::vector<Vec3> gradients(rest_.joints.size(), Vec3::Zero());
    std::vector<double> forces(gradients.size(), 0.0);
    std::vector<Vec3> normals(gradients.size(), Vec3::Zero());
    for (std::size_t j = 1; j < gradients.size(); ++j) {
        const WallContact& contact = contacts()[j];
        if (!contact.touches()) continue;
        // Where the joint is in its vessel, as that was before it made way.
        const Vec3 place = rest_.joints[j] - contact.given;
        const double radius = rest_.inner_radius() + contact.thickness;
        const double within = contact.clearance + 2 * rest_.inner_radius();
        const double distance = mesh.nearest(place, within).distance;
        if (!(distance < within)) continue;
        for (int k = 0; k < 3; ++k) {
            const Vec3 aside = step * Vec3::Unit(k);
            const double before = mesh.nearest(place - aside, within + 2 * step).distance,
                         behind = mesh.nearest(place + aside, within + 2 * step).distance;
            normals[j][k] = (before - behind) / (2 * step);
        }
        const double deep = std::max(0.0, radius - distance);
        other.most_off = std::max(other.most_off, std::abs(contact.pressed_in() - (radius - distance)));
        forces[j] = contact.stiffness * deep - contact.force();
        gradients[j] = contact.stiffness * deep * normals[j] - contact.force() * contact.normal;
    }
    auto joints = model_.pushed_by(rest_, gradients);
    if (!joints) return other;
    other.moved = Moved{std::move(*joints), std::move(forces)};
    for (std::size_t j = 1; j < gradients.size(); ++j)
        other.moved->forces[j] += grown(contacts()[j], other.moved->joints[j]);
    return other;
}

/// Each joint's vessel by these forces on all of them [mm].
std::vector<Vec3> Response::displaced(const Foundation& foundation, std::span<const double> forces) const {
    std::vector<Foundation::Load> loads;
    std::vector<Vec3> by(rest_.joints.size(), Vec3::Zero());
    for (std::size_t j = 1; j < by.size(); ++j) {
        const WallContact& contact = contacts()[j];
        if (!contact.touches()) continue;
        const Vec3 along = foundation.along(contact.station), push = forces[j] * contact.normal;
        loads.push_back({contact.station, rest_.joints[j], push - along.dot(push) * along});
    }
    if (loads.empty()) return by;
    const Foundation::Displacement displacement = foundation.displacement(loads);
    for (std::size_t j = 1; j < by.size(); ++j)
        if (contacts()[j].touches())
            by[j] = foundation.at(displacement, contacts()[j].station, rest_.joints[j]);
    return by;
}

std::optional<Moved> Response::to_vessels(const Foundation& foundation) const {
    if (!exists_) return {};
    std::vector<double> forces;
    for (const WallContact& contact : contacts()) forces.push_back(contact.force());
    const std::vector<Vec3> first = displaced(foundation, forces);
    auto moved = to_moved_wall(first);
    if (!moved) return {};
    const std::vector<Vec3> eased = displaced(foundation, moved->forces);
    double whole = 0, less = 0;
    for (std::size_t j = 0; j < first.size(); ++j)
        whole += first[j].squaredNorm(), less -= first[j].dot(eased[j]);
    if (whole > 0) scale(*moved, 1 / (1 + std::max(0.0, less / whole)));
    return moved;
}

}  // namespace physics

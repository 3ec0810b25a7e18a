#include "physics/wire/feed.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "physics/wire/bending.h"
#include "physics/wire/crossings.h"
#include "physics/wire/friction.h"
#include "physics/wire/rub_forces.h"

namespace physics {
namespace {

constexpr double rounded = 1e-9;  // of λ: lengths are sums

bool moves(std::size_t device, int which) {
    return which == every_device || static_cast<int>(device) == which;
}

/// Whether the inner device's surface moves with a hand (1), the outer one's (−1), or both or neither (0).
int slides(const Rub& rub, int which) {
    return moves(rub.inner, which) - (rub.outer != in_room && moves(rub.outer, which));
}

std::vector<double> places_of(const std::vector<double>& lengths) {
    std::vector<double> places(lengths.size(), 0.0);
    for (std::size_t j = 1; j < places.size(); ++j) places[j] = places[j - 1] + lengths[j];
    return places;
}

/// Material frames of a device after it has moved by `mm`, from those before at the old places.
void carry_wound(Device& device, const std::vector<double>& old_places, const std::vector<double>& places,
                 double mm) {
    assert(old_places.size() == device.wound.size() && old_places.size() == places.size());
    const std::vector<double> old = device.wound;
    std::size_t i = 1;
    for (std::size_t j = 1; j < places.size(); ++j) {
        const double s = std::clamp(places[j] - mm, 0.0, old_places.back());
        while (i + 1 < old.size() && old_places[i] < s) ++i;
        const double fraction =
            std::clamp((s - old_places[i - 1]) / (old_places[i] - old_places[i - 1]), 0.0, 1.0);
        device.wound[j] = old[i - 1] + fraction * (old[i] - old[i - 1]);
    }
    assert(device.wound[0] == 0);  // the frame at the introducer is where its turns count from
}

/// What the grips were before a motion.
struct OldGrips {
    std::vector<Grip> grips;
    std::vector<Vec3> joints;
    std::vector<double> places, inserted;

    int outermost(double s) const {
        for (int k = static_cast<int>(inserted.size()) - 1; k > 0; --k)
            if (inserted[k] > s - rounded) return k;
        return 0;
    }
};

void carry_grips(Chain& chain, const OldGrips& old, const std::vector<double>& places, int which, double mm) {
    assert(chain.grips.size() == places.size() && old.grips.size() == old.places.size());
    const double end = old.places.back();
    std::size_t i = 1;
    for (std::size_t j = 0; j < places.size(); ++j) {
        Grip& grip = chain.grips[j];
        const int owner = chain.outermost(places[j]);
        const bool moved = moves(owner, which), same_place = places[j] == old.places[j];
        // A joint keeps the anchor of material that has not moved.
        if (!moved && same_place && old.outermost(places[j]) == owner) continue;
        const double s = places[j] - (moved ? mm : 0.0);
        if (s > end + rounded || (s >= 0 && old.outermost(s) != owner)) {
            if (grip.holds()) chain.friction_loss += grip.energy(chain.joints[j]);
            grip.anchor = chain.joints[j];
            grip.roll = 0;
            if (chain.sticks()) grip.rested = 0;
            continue;
        }
        if (i > 1 && old.places[i - 1] > s) i = 1;
        while (i + 1 < old.places.size() && old.places[i] < s) ++i;
        const double fraction =
            std::clamp((s - old.places[i - 1]) / (old.places[i] - old.places[i - 1]), 0.0, 1.0);
        // What comes in has been in front of the introducer.
        const auto along = [&](const Vec3& a, const Vec3& b) {
            return s < 0 ? Vec3(a + s * chain.tangents[0]) : Vec3(a + fraction * (b - a));
        };
        const Vec3 before = grip.anchor;
        grip.anchor = along(old.grips[i - 1].anchor, old.grips[i].anchor);
        grip.roll =
            s < 0 ? 0.0 : old.grips[i - 1].roll + fraction * (old.grips[i].roll - old.grips[i - 1].roll);
        if (!grip.holds() || !same_place) continue;
        // The stretch mixes between joints, which takes energy.
        Grip unmixed = grip;
        unmixed.anchor = along(old.joints[i - 1], old.joints[i]) + before - chain.joints[j];
        chain.friction_loss += unmixed.energy(chain.joints[j]) - grip.energy(chain.joints[j]);
    }
}

/// Fractions a turn of the hub among the segments of a device whose distal end stands still: the shaft takes
/// it up as it would without friction.
void hold_frames(Chain& chain, int which, double turned) {
    Device& device = chain.devices[which];
    assert(device.twists_by_segments() && device.torsion.size() == chain.joints.size());
    double give = 0, place = 0;
    for (int i = 1; i <= chain.segments(); ++i) give += 1 / device.torsion[i];
    double taken = 0;
    for (int i = 1; i <= chain.segments(); ++i) {
        taken += turned / (give * device.torsion[i]);
        device.wound[i] -= taken;
        place += chain.lengths[i];
        if (!chain.grips.empty() && chain.outermost(place) == which) chain.grips[i].roll += turned - taken;
    }
    assert(std::abs(taken - turned) <= 1e-9 * std::abs(turned));  // the tip's frame stands still
}

double wrapped(double angle) {
    assert(std::isfinite(angle));
    return std::remainder(angle, 2 * M_PI);
}

/// One segment of λ in (+1) or out (-1) where the chain grows.
void insert_segment(Chain& chain, int count) {
    const double lambda = chain.grid.segment_length;
    int at = chain.growing();
    if (count < 0) {  // split off a longer one, or made whole from pieces
        for (; chain.lengths[at] > 1.5 * lambda; ++at) split_segment(chain, at);
        for (; at > 1 && chain.lengths[at] < lambda * (1 - rounded); --at) merge_segments(chain, at - 1);
    }
    const auto put = [&](auto& list, int index) {
        if (count < 0) {
            list.erase(list.begin() + index - 1);
            return;
        }
        const auto copy = list[index - 1];
        list.insert(list.begin() + index, copy);
    };
    put(chain.tangents, at + 1);
    put(chain.joints, at + 1);
    put(chain.stations, at + 1);
    assert(count > 0 || std::abs(chain.lengths[at] - lambda) <= rounded * lambda);
    put(chain.lengths, at + 1);
    if (count > 0) chain.lengths[at + 1] = lambda;
    for (Device& device : chain.devices) device.inserted += count * lambda;
    rebuild_joints(chain, at);
    assign(chain);
    assert(validate(chain).empty());
}

double length_between(const Chain& chain, int first, int last) {
    assert(first >= 1 && first <= last && last <= chain.segments());
    double sum = 0;
    for (int i = first; i <= last; ++i) sum += chain.lengths[i];
    return sum;
}

/// Makes a segment of its pieces, the last of which is this one; returns its index.
int make_whole(Chain& chain, int i) {
    while (i > 1 && chain.within_a_segment(i - 1)) merge_segments(chain, --i);
    return i;
}

/// A joint λ from the start of the growing segment, whose first piece is this one; no piece is left that is
/// shorter than the least.
void split_cell(Chain& chain, int first) {
    const double lambda = chain.grid.segment_length, least = least_piece * lambda;
    double before = 0;
    int i = first;
    for (; before + chain.lengths[i] < lambda - least; ++i) before += chain.lengths[i];
    assert(i <= chain.growing() && before < lambda);
    const auto past = [&] { return std::abs(before + chain.lengths[i] - lambda); };
    // A piece that ends just the least before it is not split beyond its end.
    while ((past() < least || before + chain.lengths[i] < lambda) && i < chain.growing()) {
        if (past() < rounded * lambda) return;
        merge_segments(chain, i);
    }
    split_segment(chain, i, (lambda - before) / chain.lengths[i]);
}

}  // namespace

int first_growing(const Chain& chain) {
    int i = chain.growing();
    while (i > 1 && chain.within_a_segment(i - 1)) --i;
    return i;
}

FeedPlan plan_feed(const Chain& chain, int which, double mm) {
    assert(which >= every_device && which < static_cast<int>(chain.devices.size()) && std::isfinite(mm));
    const double lambda = chain.grid.segment_length;
    FeedPlan plan;
    plan.device = which;
    plan.mm = std::clamp(mm, -lambda, lambda);
    double still = 0, moving = 0;  // length of the longest that stays where it is, and that moves
    for (std::size_t k = 0; k < chain.devices.size(); ++k) {
        const double inserted = chain.devices[k].inserted;
        if (!moves(k, which)) {
            still = std::max(still, inserted);
        } else {
            moving = std::max(moving, inserted);
            plan.mm = std::max(plan.mm, -inserted);
        }
    }
    const double least = least_length(chain.grid);
    if (still < least) plan.mm = std::max(plan.mm, std::min(0.0, least - moving));
    double change = std::max(still, moving + plan.mm) - chain.inserted_length();
    if (std::abs(change) <= rounded * lambda) change = 0;
    assert(std::abs(plan.mm) <= lambda && plan.mm * mm >= 0);  // less of it, never the other way
    assert(std::abs(change) <= std::abs(plan.mm) + 1e-6);
    const int grows = plan.grows = chain.growing(), before = grows - 1;
    const bool in_pieces = first_growing(chain) < grows;
    const double cell = length_between(chain, first_growing(chain), grows);
    const auto whole = [&](int joint) { return joint < 1 || !chain.within_a_segment(joint); };
    plan.whole = whole(grows);
    if (change < 0 && before >= 1 && cell + change < (0.5 - rounded) * lambda) {
        const double both = chain.lengths[before] + chain.lengths[grows];
        plan.change_before = change * chain.lengths[before] / both;
        plan.whole = plan.whole && !in_pieces && whole(before - 1) && chain.lengths[before] <= 1.5 * lambda;
    }
    plan.change = change - plan.change_before;
    const double left = chain.lengths[grows] + plan.change;
    plan.whole = plan.whole && left > (in_pieces ? least_piece * lambda : 1e-6 * chain.lengths[grows]);
    return plan;
}

void stretch(Chain& chain, const FeedPlan& plan) {
    // feed() also moves chains that were split and merged by hand, whose pieces are none of λ.
    assert(plan.grows >= 1 && plan.grows <= chain.segments() && chain.lengths[plan.grows] + plan.change > 0);
    assert(plan.change_before == 0 || chain.lengths[plan.grows - 1] + plan.change_before > 0);
    OldGrips old;
    const bool twists = std::any_of(chain.devices.begin(), chain.devices.end(),
                                    [](const Device& device) { return device.twists_by_segments(); });
    if (!chain.grips.empty()) {
        old.grips = chain.grips;
        old.joints = chain.joints;
        for (const Device& device : chain.devices) old.inserted.push_back(device.inserted);
    }
    if (!chain.grips.empty() || twists) old.places = places_of(chain.lengths);
    const int first = first_fed(chain, plan.device);
    for (Rub& rub : chain.rubs) rub.moved.x() += plan.mm * slides(rub, plan.device);
    for (std::size_t k = 0; k < chain.devices.size(); ++k)
        if (moves(k, plan.device)) chain.devices[k].inserted += plan.mm;
    chain.lengths[plan.grows] += plan.change;
    if (plan.change_before != 0) chain.lengths[plan.grows - 1] += plan.change_before;
    // The chain's length is a sum of its segments': the device that makes it is exactly as long.
    const double reached = chain.inserted_length();
    double longest = 0;
    for (const Device& device : chain.devices) longest = std::max(longest, device.inserted);
    assert(std::abs(longest - reached) < 1e-6);
    for (Device& device : chain.devices)
        if (device.inserted > longest - rounded) device.inserted = reached;
    rebuild_joints(chain, std::max(1, plan.grows - 1));
    if (!old.places.empty()) {
        const std::vector<double> places = places_of(chain.lengths);
        for (std::size_t k = 0; k < chain.devices.size(); ++k)
            if (chain.devices[k].twists_by_segments())
                carry_wound(chain.devices[k], old.places, places, moves(k, plan.device) ? plan.mm : 0.0);
        if (!chain.grips.empty()) carry_grips(chain, old, places, plan.device, plan.mm);
    }
    assign_from(chain, first);
    // A shaft that nothing holds any more has let go.
    for (Device& device : chain.devices)
        if (device.windup != 0 && device.windup_stiffness == 0) {
            device.roll = wrapped(device.roll + device.windup);
            device.windup = 0;
        }
}

namespace {

/// Whole segments of the leading device's shape that are inside, distal of the one that grows.
int tip_inside(const Chain& chain) {
    assert(chain.segments() >= 1);
    double length = 0;
    for (int i = chain.growing() + 1; i <= chain.segments(); ++i) length += chain.lengths[i];
    return static_cast<int>(std::lround(length / chain.grid.segment_length));
}

}  // namespace

void regrid(Chain& chain, const FeedPlan& made) {
    const double lambda = chain.grid.segment_length;
    int grows = chain.growing(), first = first_growing(chain);
    // On the way out two segments have become shorter: they become one, or a whole one and a rest.
    if (made.change_before != 0 || length_between(chain, first, grows) < (0.5 - rounded) * lambda)
        grows = make_whole(chain, grows);
    if (chain.segments() > 2 && length_between(chain, first_growing(chain), grows) < (0.5 - rounded) * lambda)
        merge_segments(chain, std::max(1, grows - 1));
    for (;;) {
        grows = chain.growing(), first = first_growing(chain);
        if (length_between(chain, first, grows) < (1.5 - rounded) * lambda) break;
        // The whole segment joins the shape, as long as that is not all inside.
        if (first == 1 && tip_inside(chain) < chain.tip_segments) {
            grows = make_whole(chain, grows);
            split_segment(chain, grows, 1 - lambda / chain.lengths[grows]);
        } else {
            split_cell(chain, first);
        }
    }
    follow_leader(chain);
    assert(validate(chain).empty());
}

double feed(Chain& chain, int device, double mm) {
    assert(device >= every_device && device < static_cast<int>(chain.devices.size()) && std::isfinite(mm));
    const double lambda = chain.grid.segment_length;
    double fed = 0;
    for (;;) {
        while (chain.growing() < chain.segments() && chain.within_a_segment(chain.growing()))
            merge_segments(chain, chain.growing());
        const double part = std::clamp(mm - fed, -lambda, lambda);
        FeedPlan plan = plan_feed(chain, device, part);
        if (!plan.whole) {
            if (const int grows = make_whole(chain, chain.growing()); grows > 1)
                for (int before = make_whole(chain, grows - 1); chain.lengths[before] > 1.5 * lambda;
                     ++before)
                    split_segment(chain, before);
            plan = plan_feed(chain, device, part);
        }
        // What is shorter than what goes out becomes one with more of the chain.
        while (chain.segments() > 2 && !(chain.lengths[plan.grows] + plan.change > rounded * lambda)) {
            merge_segments(chain, std::max(1, plan.grows - 1));
            plan = plan_feed(chain, device, part);
        }
        if (plan.mm == 0) return fed;
        stretch(chain, plan);
        regrid(chain, plan);
        fed += plan.mm;
        assert(std::abs(fed) <= std::abs(mm) + 1e-9);
        if (plan.mm != part || std::abs(mm - fed) < 1e-12 * lambda) return fed;
    }
}

void hold_at(Chain& chain, int which, double distance) {
    assert(std::isfinite(distance) && distance >= 0);
    Device& device = chain.devices[which];
    const bool segments = device.twists_by_segments();
    const double before = segments ? device.torsion[1] : device.windup_stiffness;
    device.outside = distance;
    assign(chain);
    const double now = segments ? device.torsion[1] : device.windup_stiffness;
    if (!(before > 0 && now > 0)) return;
    // What lies inside stays as it is; the hand takes the shaft where the torque is the same.
    const double twist = segments ? device.wound[1] : device.windup, change = (before / now - 1) * twist;
    if (!segments) {
        device.windup += change;
        return;
    }
    device.roll -= change;
    for (std::size_t j = 1; j < device.wound.size(); ++j) device.wound[j] += change;
}

void rotate(Chain& chain, int which, double angle) {
    assert(which >= every_device && which < static_cast<int>(chain.devices.size()) && std::isfinite(angle));
    for (Rub& rub : chain.rubs) rub.moved.y() += radius_of(chain, rub) * angle * slides(rub, which);
    for (std::size_t k = 0; k < chain.devices.size(); ++k) {
        if (!moves(k, which)) continue;
        Device& device = chain.devices[k];
        assert(device.windup_stiffness == 0 || !device.twists_by_segments());
        if (device.windup_stiffness > 0) {
            device.windup += angle;
        } else {
            device.roll = wrapped(device.roll + angle);
            if (device.twists_by_segments()) hold_frames(chain, static_cast<int>(k), angle);
        }
    }
}

void start_twists(Chain& chain, int which) {
    assert(which >= 0 && which < static_cast<int>(chain.devices.size()));
    Device& device = chain.devices[which];
    if (!device.spec.twists() || device.twists_by_segments()) return;
    device.roll = wrapped(device.roll + device.windup);
    device.wound.assign(chain.joints.size(), 0.0);
    const double windup = std::exchange(device.windup, 0.0);
    assign(chain);
    hold_frames(chain, which, windup);
}

int move(Chain& chain, double mm) {
    assert(chain.grips.empty());
    // A sum of decimal steps that should make a whole segment does, in spite of rounding.
    const double lambda = chain.grid.segment_length, whole = lambda * (1 - rounded);
    int made = 0;
    chain.carried += mm;
    while (chain.carried >= whole) {
        insert_segment(chain, 1);
        chain.carried -= lambda;
        ++made;
    }
    while (chain.carried <= -whole) {
        bool all_inside = chain.inserted_length() > (3 - rounded) * lambda;
        for (const Device& device : chain.devices) all_inside = all_inside && device.inserted > lambda;
        if (!all_inside) {
            chain.carried = 0;  // the hub can't pull the tip out of the introducer
            break;
        }
        insert_segment(chain, -1);
        chain.carried += lambda;
        --made;
    }
    assert(std::abs(chain.carried) < lambda);
    return made;
}

namespace {

/// Energy of a chain whose devices lie elsewhere, with all tangents and turns as they are in `at`, but for
/// what all states have in common: bending and twist, and wall, grips and load to first order. Nothing
/// changes proximal of joint `first`; joints from `grows` on move with their segment.
double fed_energy(const Chain& at, const Chain& fed, int first, int grows, const std::vector<Vec3>& frames,
                  std::span<const WallContact> contacts) {
    assert(at.segments() == fed.segments() && first >= 0 && grows >= 1 && grows <= at.segments());
    const int n = at.segments();
    double energy = coupling_energy(fed, first) + twist_energy(fed);
    for (int j = first; j < n; ++j) energy += joint_energy(fed, frames, j);
    Vec3 push = Vec3::Zero();  // of the joints that move
    for (int j = std::max(1, first); j <= n; ++j) {
        if (j >= grows) {
            push += contacts[j].push() - at.length_of(j) * at.load;
            if (!at.grips.empty() && at.grips[j].holds()) push += at.grips[j].push(at.joints[j]);
        }
        energy += contacts[j].force() * (fed.thickness[j] - at.thickness[j]);
        const double grown = fed.length_of(j) / at.length_of(j) - 1;
        if (grown != 0)
            energy += grown * (contacts[j].wall_energy() -
                               at.length_of(j) * at.load.dot(at.joints[j] - at.joints[0]));
    }
    return energy + (fed.lengths[grows] - at.lengths[grows]) * push.dot(at.tangents[grows]);
}

/// What the grips add where devices' material slides by them, per device: at every joint but those that go
/// with it.
void add_slides(const Chain& chain, int grows, std::vector<HubLoad>& loads) {
    assert(chain.grips.size() == chain.joints.size() && loads.size() == chain.devices.size());
    double place = 0;
    for (int j = 1; j <= chain.segments(); ++j) {
        place += chain.lengths[j];
        if (!chain.grips[j].holds()) continue;
        const double along = chain.grips[j].push(chain.joints[j]).dot(chain.tangents[j]);
        const int owner = chain.outermost(place);
        if (j < grows)
            loads[owner].push += along;
        else if (owner != chain.leading) {
            // It moves along material that stays, or stays at a joint while its own moves.
            loads[chain.leading].push -= along;
            loads[owner].push += along;
        }
    }
}

}  // namespace

std::vector<HubLoad> hub_loads(const Chain& chain, std::span<const WallContact> contacts) {
    constexpr double by = 1e-5;  // [mm]: of the push this leaves 1e-5 mm · d²U/ds², of rounding 1e-10 N
    assert(contacts.size() == chain.joints.size());
    const int grows = chain.growing();
    std::vector<Vec3> frames;
    if (chain.bent_segments() > 0) frames = directors(chain);
    std::vector<HubLoad> loads(chain.devices.size());
    std::vector<double> torque;
    Chain fed = chain;
    for (int k = 0; k < static_cast<int>(loads.size()); ++k) {
        if (chain.devices[k].inserted <= 0) continue;
        const int first = first_fed(chain, k);
        assert(first < grows);  // so that all that a feed changes is distal of it
        fed.devices[k].inserted = chain.devices[k].inserted + by;
        fed.lengths[grows] = chain.lengths[grows] + (k == chain.leading ? by : 0.0);
        assign_from(fed, first);
        loads[k].push = (fed_energy(chain, fed, first, grows, frames, contacts) -
                         fed_energy(chain, chain, first, grows, frames, contacts)) /
                        by;
        fed.devices[k].inserted = chain.devices[k].inserted;
        fed.lengths[grows] = chain.lengths[grows];
        if (k + 1 < static_cast<int>(loads.size())) assign_from(fed, first);
        if (frames.empty()) continue;
        frame_torque(chain, frames, k, torque);
        loads[k].torque = torque[0];
    }
    if (!chain.grips.empty()) add_slides(chain, grows, loads);
    add_rubs(chain, contacts, loads);
    return loads;
}

}  // namespace physics

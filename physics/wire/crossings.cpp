#include "physics/wire/crossings.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace physics {
namespace {

constexpr double steepest = 1.1;        // of penetration at most, smoothed creases included
constexpr double shortest = 0.01;       // stretch of a segment that is still halved [mm]
constexpr double precision = 0.02;      // of the depth that is found [mm]
constexpr double near_to = 0.25;        // of λ: a segment that would cross a wall nearer by this is split
constexpr double clear_of = 0.4;        // of λ: a segment made whole would not cross a wall nearer by this
constexpr double whole_fraction = 0.5;  // of the tolerance that a segment made whole may use
constexpr double least_part = 0.25;     // of a segment that a split leaves on either side
constexpr int rounds_of_splits = 4;     // at most; pieces stay no shorter than least_piece

/// A place of a segment where the wall was asked.
struct Probe {
    double at = 0;  // from the proximal end [mm]
    WallContact contact;
};

/// Upper bound of penetration as far as `distance` from a probe [mm].
struct Bound {
    double value, slope, curve;
    double operator()(double distance) const {
        assert(distance >= 0);
        return value + distance * (slope + 0.5 * curve * distance);
    }
};

Bound by_slope(const WallContact& c) {
    return {c.penetration > 0 ? c.penetration : -steepest * c.trust, steepest, 0};
}

/// Near a wall that is nowhere bent more tightly than the lumen is wide, penetration grows along `direction`
/// by its slope and, to second order, by no more than 1/room; from half the way to the axis on, by twice
/// that.
Bound by_normal(const WallContact& c, const Vec3& direction) {
    assert(c.clearance > 0);
    return {c.penetration, c.normal.dot(direction), 2 / c.clearance};
}

bool knows_its_wall(const WallContact& c) {
    return c.clearance > 0 && !c.normal.isZero(0) && -c.penetration < 0.5 * c.clearance;
}

/// Largest value that both bounds allow between places `length` apart. Each is convex, so it is at an end or
/// where they meet.
double peak(const Bound& a, const Bound& b, double length) {
    assert(length > 0 && a.curve == b.curve);
    double highest = std::max(std::min(a(0), b(length)), std::min(a(length), b(0)));
    const double rise = a.slope + b.slope + a.curve * length;  // of a − b; both have the same curve
    if (rise != 0) {
        const double at = (b(length) - a(0)) / rise;
        if (at > 0 && at < length) highest = std::max(highest, std::min(a(at), b(length - at)));
    }
    return highest;
}

/// The contact with a vessel that has made way, by `given`, and now stays there.
WallContact where_it_is(WallContact c) {
    c.penetration = c.pressed_in();
    c.give = 0;
    return c;
}

class Search {
public:
    Search(const LumenWall& wall, const Vec3& from, const Vec3& to)
        : wall_(wall), from_(from), length_((to - from).norm()), direction_((to - from) / length_) {}

    /// The segment goes from one vessel into another.
    void goes_over(const WallContact& from, const WallContact& to) {
        vessels_ = {from.given, to.given};
        stations_ = {from.station, to.station};
        goes_over_ = true;
    }

    std::optional<Crossing> run(const WallContact& at_from, const WallContact& at_to, double tolerance) {
        assert(length_ > 0 && tolerance >= 0);
        const double ends = std::max({0.0, at_from.penetration, at_to.penetration});
        assert(at_from.give == 0 && at_to.give == 0);
        limit_ = ends + tolerance;
        look_between({0, at_from}, {length_, at_to});
        if (deepest_at_ < 0) return std::nullopt;
        assert(deepest_at_ > 0 && deepest_at_ < length_ && deepest_ > ends + tolerance);
        return Crossing{0, deepest_at_ / length_, deepest_ - ends};
    }

private:
    double most_between(const Probe& a, const Probe& b) const {
        assert(a.at >= 0 && a.at < b.at && b.at <= length_);
        const double length = b.at - a.at;
        double most = peak(by_slope(a.contact), by_slope(b.contact), length);
        if (most <= limit_ || !knows_its_wall(a.contact) || !knows_its_wall(b.contact)) return most;
        Bound ahead = by_normal(a.contact, direction_), back = by_normal(b.contact, -direction_);
        ahead.curve = back.curve = std::max(ahead.curve, back.curve);
        return std::min(most, peak(ahead, back, length));
    }

    void look_between(const Probe& a, const Probe& b) {
        assert(a.at < b.at);
        const double length = b.at - a.at;
        if (a.contact.trust + b.contact.trust >= length || length < shortest) return;
        if (most_between(a, b) <= limit_) return;
        Probe middle{0.5 * (a.at + b.at), {}};
        if (goes_over_) {
            // What either vessel holds is in neither's wall.
            middle.contact = ask(a, b, middle.at, stations_[0], vessels_[0]);
            const WallContact other = ask(a, b, middle.at, stations_[1], vessels_[1]);
            if (other.penetration < middle.contact.penetration) middle.contact = other;
        } else {
            middle.contact =
                ask(a, b, middle.at, a.contact.station, 0.5 * (a.contact.given + b.contact.given));
        }
        if (middle.contact.penetration > limit_) {
            deepest_ = middle.contact.penetration;
            deepest_at_ = middle.at;
            limit_ = deepest_ + precision;
        }
        look_between(a, middle);
        look_between(middle, b);
    }

    WallContact ask(const Probe& a, const Probe& b, double at, int station, const Vec3& given) const {
        WallContact c;
        c.station = station;
        c.thickness = std::min(a.contact.thickness, b.contact.thickness);
        const Vec3 x = from_ + at * direction_ - given;
        wall_.contacts({&x, 1}, {&c, 1});
        c.given = given;
        return c;
    }

    const LumenWall& wall_;
    Vec3 from_;
    double length_;
    Vec3 direction_;
    double limit_ = 0;  // of penetration: nothing less is searched for [mm]
    double deepest_ = 0, deepest_at_ = -1;
    bool goes_over_ = false;
    std::array<Vec3, 2> vessels_;    // how far each has made way [mm]
    std::array<int, 2> stations_{};  // in each
};

/// The wall of the vessel where it lies now, as the joint would find it at this place if the wall were
/// `nearer`.
WallContact wall_at(const Chain& wire, const LumenWall& wall, int joint, const Vec3& place, double nearer) {
    assert(joint >= 0 && joint <= wire.segments() && nearer >= 0);
    WallContact c;
    c.station = wire.stations[joint];
    c.thickness = wire.thickness[joint] + nearer;
    const Vec3 given = wire.grips.empty() ? Vec3(Vec3::Zero()) : wire.grips[joint].given, x = place - given;
    wall.contacts({&x, 1}, {&c, 1});
    c.given = given;
    return c;
}

/// Whether a joint is near the wall, or the segment merged from both its own would cross it or come close. A
/// segment that a joint holds off a carina does not cross: without the joint it would again, and to merge and
/// split it with every motion would cost or give energy.
bool needed(const Chain& wire, const LumenWall& wall, int joint, double tolerance) {
    assert(joint >= 1 && joint < wire.segments() && tolerance >= 0);
    const double clear = clear_of * wire.grid.segment_length;
    if (wall_at(wire, wall, joint, wire.joints[joint], clear).touches()) return true;
    const Vec3 from = wire.joints[joint - 1], direction = (wire.joints[joint + 1] - from).normalized();
    const Vec3 to = from + (wire.lengths[joint] + wire.lengths[joint + 1]) * direction;
    return crossing_between(wall, from, to, wall_at(wire, wall, joint - 1, from, clear),
                            wall_at(wire, wall, joint + 1, to, clear), tolerance)
        .has_value();
}

}  // namespace

std::optional<Crossing> crossing_between(const LumenWall& wall, const Vec3& from, const Vec3& to,
                                         const WallContact& at_from, const WallContact& at_to,
                                         double tolerance) {
    assert(tolerance >= 0);
    if (at_from.trust + at_to.trust >= (to - from).norm()) return std::nullopt;
    WallContact first = where_it_is(at_from), last = where_it_is(at_to);
    // A vessel that one end has pushed aside has moved at the other one, too.
    const auto go_with = [](WallContact& c, const WallContact& other) {
        if (c.touches()) return;
        c.trust = std::max(0.0, c.trust - (other.given - c.given).norm());
        c.given = other.given;
    };
    if (first.touches() != last.touches()) go_with(first, last), go_with(last, first);
    Search search(wall, from, to);
    if (first.given != last.given && !wall.same_vessel(first.station, last.station))
        search.goes_over(first, last);
    return search.run(first, last, tolerance);
}

std::vector<Crossing> crossings(const Chain& wire, std::span<const WallContact> contacts,
                                const LumenWall& wall, double tolerance) {
    assert(contacts.size() == wire.joints.size());
    std::vector<Crossing> found;
    for (int i = 1; i <= wire.segments(); ++i) {
        auto crossing = crossing_between(wall, wire.joints[i - 1], wire.joints[i], contacts[i - 1],
                                         contacts[i], tolerance);
        if (!crossing) continue;
        crossing->segment = i;
        found.push_back(*crossing);
    }
    return found;
}

int split_crossings(Chain& wire, std::span<const Crossing> found) {
    assert(std::is_sorted(found.begin(), found.end(),
                          [](const Crossing& a, const Crossing& b) { return a.segment < b.segment; }));
    const double lambda = wire.grid.segment_length;
    int count = 0;
    for (auto crossing = found.rbegin(); crossing != found.rend(); ++crossing) {
        const int i = crossing->segment;
        const bool coarse = wire.lengths[i] > 1.5 * lambda;
        const double fraction = coarse ? 0.5 : std::clamp(crossing->fraction, least_part, 1 - least_part);
        if (std::min(fraction, 1 - fraction) * wire.lengths[i] < least_piece * lambda) continue;
        split_segment(wire, i, fraction);
        ++count;
    }
    return count;
}

int split_before_edges(Chain& wire, const LumenWall& wall, double tolerance) {
    assert(tolerance >= 0);
    int count = 0;
    for (int round = 0; round < rounds_of_splits; ++round) {
        std::vector<WallContact> contacts;
        for (int j = 0; j <= wire.segments(); ++j)
            contacts.push_back(wall_at(wire, wall, j, wire.joints[j], near_to * wire.grid.segment_length));
        const int split = split_crossings(wire, crossings(wire, contacts, wall, tolerance));
        if (split == 0) break;
        count += split;
    }
    return count;
}

int merge_pieces(Chain& wire, const LumenWall& wall, bool every, double tolerance) {
    assert(tolerance >= 0);
    int count = 0;
    for (int i = wire.segments() - 1; i >= 1; --i) {
        if (!wire.within_a_segment(i)) continue;
        if (!every && needed(wire, wall, i, whole_fraction * tolerance)) continue;
        merge_segments(wire, i);
        ++count;
    }
    return count;
}

}  // namespace physics

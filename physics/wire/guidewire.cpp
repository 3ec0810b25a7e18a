#include "physics/wire/guidewire.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace physics {
namespace {

bool finite_positive(double x) {
    return std::isfinite(x) && x > 0;
}

std::string joined(const std::vector<std::string>& sentences) {
    std::string text;
    for (const std::string& s : sentences) text += (text.empty() ? "" : " ") + s;
    return text;
}

/// Lengths are whole numbers of λ to this share of it, in spite of rounding.
constexpr double whole_segment = 1e-9;

bool whole_number(double length, double lambda) {
    return std::abs(length / lambda - std::round(length / lambda)) < 1e-6;
}

/// EI and rest angle are those of the material at each joint, so they move with the wire.
void assign_material(Guidewire& wire) {
    if (!wire.devices.empty()) return assign_devices(wire);
    const int n = wire.segments();
    const int curved = wire.curved_segments(), bends = wire.spec.curved_segments();
    wire.rigidity.assign(n + 1, 0.0);
    wire.rest_angle.assign(n + 1, 0.0);
    double from_end = 0;
    for (int i = n - 1; i >= 0; --i) {
        from_end += wire.lengths[i + 1];
        wire.rigidity[i] = rigidity_at(wire.spec, from_end);
        if (i >= n - curved && whole_number(from_end, wire.spec.segment_length))
            wire.rest_angle[i] = wire.spec.curved_angle / bends;
    }
    if (wire.twists.empty()) return;
    wire.torsion.assign(n + 1, 0.0);
    from_end = 0;
    for (int i = n; i >= 1; --i) {
        const double length = wire.lengths[i];
        wire.torsion[i] = torsional_rigidity_at(wire.spec, from_end + 0.5 * length) / length;
        from_end += length;
    }
}

/// Segments of the shaft of a wire that is fed: whole ones and a last one of λ/2 to 3λ/2.
struct Shaft {
    int whole = 0;
    double last = 0;  // [mm]
    Shaft(const GuidewireSpec& spec, double length) {
        const double lambda = spec.segment_length;
        whole = std::max(0, static_cast<int>(std::floor(length / lambda - 0.5 + whole_segment)));
        last = length - whole * lambda;
    }
};

Guidewire chain(const GuidewireSpec& spec, const Vec3& entry, const Vec3& clamped, int segments) {
    Guidewire wire;
    wire.spec = spec;
    wire.joints.assign(segments + 1, entry);
    wire.tangents.assign(segments + 1, clamped);
    wire.lengths.assign(segments + 1, spec.segment_length);
    wire.lengths[0] = 0;
    wire.stations.assign(segments + 1, -1);
    Vec3 other;
    tangent_basis(clamped, wire.base_director, other);
    return wire;
}

/// The hub has turned by this much while the distal end stood still: the shaft between takes it up, as it
/// would without friction.
void hold_frames(Guidewire& wire, double turned) {
    double give = 0;
    for (int i = 1; i <= wire.segments(); ++i) give += 1 / wire.torsion[i];
    double left = turned;  // of the frame behind segment i
    for (int i = 1; i <= wire.segments(); ++i) {
        const double part = turned / (give * wire.torsion[i]);
        wire.twists[i] -= part;
        left -= part;
        if (!wire.grips.empty()) wire.grips[i].roll += left;
    }
}

/// du/ds at a joint as the chain has it, 0 where the wire is bent without load [1/mm].
Vec3 curvature_at(const Guidewire& wire, int joint) {
    if (joint == wire.segments() || wire.rest_angle[joint] != 0) return Vec3::Zero();
    return (wire.tangents[joint + 1] - wire.tangents[joint]) / wire.length_of(joint);
}

}  // namespace

int GuidewireSpec::curved_segments() const {
    if (curved_angle == 0 || curved_length <= 0) return 0;
    return std::max(1, static_cast<int>(std::lround(curved_length / segment_length)));
}

std::vector<std::string> problems(const GuidewireSpec& s) {
    std::vector<std::string> out;
    const auto need = [&](bool ok, const std::string& text) {
        if (!ok) out.push_back(text);
    };
    const auto need_within = [&](const char* name, double value, char bracket, double most,
                                 const char* unit) {
        std::ostringstream text;
        text << name << " must lie in " << bracket << "0, " << most << "] " << unit << '.';
        need((bracket == '(' ? finite_positive(value) : std::isfinite(value) && value >= 0) && value <= most,
             text.str());
    };
    need_within("segment_length", s.segment_length, '(', WireLimits::segment_length, "mm");
    need_within("diameter", s.diameter, '(', WireLimits::diameter, "mm");
    need_within("shaft_rigidity", s.shaft_rigidity, '(', WireLimits::rigidity, "N·mm²");
    need_within("tip_rigidity", s.tip_rigidity, '(', WireLimits::rigidity, "N·mm²");
    need_within("tip_length", s.tip_length, '[', WireLimits::soft_length, "mm");
    need_within("transition_length", s.transition_length, '[', WireLimits::soft_length, "mm");
    need_within("curved_length", s.curved_length, '[', WireLimits::curved_length, "mm");
    need_within("buckling_force", s.buckling_force, '[', WireLimits::buckling_force, "N");
    need_within("torsional_rigidity", s.torsional_rigidity, '[', WireLimits::rigidity, "N·mm²");
    need_within("friction", s.friction, '[', WireLimits::friction, "");
    // Rounding in a conversion from degrees must not reject the limit itself.
    need(
        std::isfinite(s.curved_angle) && std::abs(s.curved_angle) <= WireLimits::curved_angle * degree + 1e-9,
        "curved_angle must lie in [-270, 270] degrees.");
    if (out.empty() && s.curved_angle != 0 && s.curved_length > 0) {
        need(std::abs(s.curved_angle) / s.curved_segments() <= 1.0,
             "the curved tip turns by more than 57 degrees at a joint: use shorter segments.");
    }
    return out;
}

double Guidewire::windup_stiffness() const {
    const int curved = curved_segments();
    if (spec.torsional_rigidity == 0 || curved == 0 || !twists.empty()) return 0;
    double give = 0, from_end = 0;
    for (int i = segments(); i >= 1; --i) {
        if (i <= segments() - curved)
            give += lengths[i] / torsional_rigidity_at(spec, from_end + 0.5 * lengths[i]);
        from_end += lengths[i];
    }
    return 1 / give;
}

double Guidewire::wound_up() const {
    return std::accumulate(twists.begin(), twists.end(), windup, std::minus());
}

double Guidewire::inserted_length() const {
    double sum = 0;
    for (int i = 1; i <= segments(); ++i) sum += lengths[i];
    return sum;
}

int Guidewire::curved_segments() const {
    double left = spec.curved_segments() * spec.segment_length * (1 - whole_segment);
    int count = 0;
    for (int i = segments(); i >= 1 && left > 0; --i, ++count) left -= lengths[i];
    return count;
}

bool Guidewire::within_a_segment(int joint) const {
    const double lambda = spec.segment_length, slack = 1e-6 * lambda;
    const auto whole = [&](int i) { return lengths[i] == lambda || lengths[i] > 1.5 * lambda; };
    if (joint < 1 || joint >= segments() || whole(joint) || whole(joint + 1)) return false;
    double from_base = 0;
    for (int i = 1; i <= joint; ++i) from_base += lengths[i];
    const double shaft = inserted_length() - spec.curved_segments() * lambda;
    if (from_base > shaft - slack) return !whole_number(from_base - shaft, lambda);
    return from_base > Shaft(spec, shaft).whole * lambda + slack || !whole_number(from_base, lambda);
}

Guidewire straight_wire(const GuidewireSpec& spec, const Vec3& entry, const Vec3& direction, int segments) {
    const double length = direction.norm();
    if (!entry.allFinite() || !std::isfinite(length) || length < 1e-12)
        throw std::invalid_argument("a wire needs a finite entry and a direction that is not zero");
    const Vec3 u = direction / length;
    return wire_along(spec, {entry, entry + (segments + 1) * spec.segment_length * u}, segments);
}

namespace {

/// Puts the joints on the path, each a length of the wire's from the last; the number of segments is right.
void lay_along(Guidewire& wire, const Polyline& path) {
    std::size_t piece = 1;
    for (int i = 1; i <= wire.segments(); ++i) {
        const Vec3 from = wire.joints[i - 1];
        const double lambda = wire.lengths[i];
        Vec3 u = wire.tangents[i - 1];
        // The next point of the path that is far enough; past its end the path goes on straight.
        for (; piece < path.size(); ++piece) {
            if ((path[piece] - from).norm() < lambda) continue;
            const Vec3 a = path[piece - 1] - from, d = path[piece] - path[piece - 1];
            const double dd = d.squaredNorm(), ad = a.dot(d), c = a.squaredNorm() - lambda * lambda;
            if (dd < 1e-24) continue;
            const double t = (-ad + std::sqrt(std::max(0.0, ad * ad - dd * c))) / dd;
            u = (a + t * d).normalized();
            break;
        }
        wire.tangents[i] = u;
        wire.joints[i] = from + lambda * u;
    }
    assign_material(wire);
}

/// A wire of that many segments with all its joints at the start of the path. Throws std::invalid_argument.
Guidewire wire_at_start_of(const GuidewireSpec& spec, const Polyline& path, int segments) {
    if (const auto wrong = problems(spec); !wrong.empty()) throw std::invalid_argument(joined(wrong));
    if (path.size() < 2) throw std::invalid_argument("a wire's path needs at least two points");
    for (const Vec3& p : path)
        if (!p.allFinite()) throw std::invalid_argument("a wire's path has a point that is not finite");
    const Vec3 first = path[1] - path[0];
    if (first.norm() < 1e-12) throw std::invalid_argument("a wire's path starts with two equal points");
    const int least = spec.curved_segments() + 1;
    if (segments < least)
        throw std::invalid_argument("a wire needs its curved tip and one segment more inside: " +
                                    std::to_string(least) + " segments, not " + std::to_string(segments));
    return chain(spec, path[0], first.normalized(), segments);
}

}  // namespace

Guidewire wire_along(const GuidewireSpec& spec, const Polyline& path, int segments) {
    Guidewire wire = wire_at_start_of(spec, path, segments);
    lay_along(wire, path);
    return wire;
}

double least_length(const GuidewireSpec& spec) {
    return (spec.curved_segments() + 1) * spec.segment_length;
}

Guidewire wire_of_length(const GuidewireSpec& spec, const Polyline& path, double length) {
    const int curved = spec.curved_segments();
    if (!(std::isfinite(length) && length >= least_length(spec) * (1 - whole_segment)))
        throw std::invalid_argument(
            "a wire needs its curved tip and one segment more inside: " + std::to_string(least_length(spec)) +
            " mm, not " + std::to_string(length));
    const Shaft shaft(spec, length - curved * spec.segment_length);
    Guidewire wire = wire_at_start_of(spec, path, shaft.whole + 1 + curved);
    wire.lengths[shaft.whole + 1] = shaft.last;
    lay_along(wire, path);
    return wire;
}

Guidewire uniform_wire(double rigidity, double segment_length, const Vec3& entry, const Vec3& clamped,
                       const std::vector<Vec3>& tangents, EndCells end_cells) {
    GuidewireSpec spec;
    spec.end_cells = end_cells;
    spec.segment_length = segment_length;
    spec.shaft_rigidity = spec.tip_rigidity = rigidity;
    spec.tip_length = spec.transition_length = spec.curved_length = spec.curved_angle = 0;
    if (const auto wrong = problems(spec); !wrong.empty()) throw std::invalid_argument(joined(wrong));
    if (tangents.empty()) throw std::invalid_argument("a wire needs at least one segment");
    Guidewire wire = chain(spec, entry, clamped.normalized(), static_cast<int>(tangents.size()));
    for (std::size_t i = 0; i < tangents.size(); ++i) wire.tangents[i + 1] = tangents[i].normalized();
    rebuild_joints(wire);
    assign_material(wire);
    return wire;
}

void start_grips(Guidewire& wire) {
    wire.grips.clear();
    wire.friction_loss = 0;
    if (wire.spec.friction == 0) return;
    wire.grips.resize(wire.joints.size());
    for (std::size_t i = 0; i < wire.joints.size(); ++i) wire.grips[i].anchor = wire.joints[i];
}

void start_twists(Guidewire& wire) {
    if (wire.spec.torsional_rigidity == 0) return;
    assert(wire.devices.empty());
    wire.roll = std::remainder(wire.roll + wire.windup, 2 * M_PI);
    wire.twists.assign(wire.joints.size(), 0.0);
    const double windup = std::exchange(wire.windup, 0.0);
    assign_material(wire);
    hold_frames(wire, windup);
}

double twist_energy(const Guidewire& wire, std::span<const double> twists, int first) {
    double energy = 0;
    for (std::size_t i = first; i < twists.size(); ++i) energy += wire.torsion[i] * twists[i] * twists[i];
    return 0.5 * energy;
}

void split_segment(Guidewire& wire, int i, double share) {
    const Vec3 u = wire.tangents[i];
    const double length = wire.lengths[i];
    Vec3 turn = 0.125 * length * (curvature_at(wire, i - 1) + curvature_at(wire, i));
    turn -= turn.dot(u) * u;
    // The longer part turns less, so that the chord keeps its direction.
    wire.tangents[i] = (u - 2 * (1 - share) * turn).normalized();
    wire.tangents.insert(wire.tangents.begin() + i + 1, (u + 2 * share * turn).normalized());
    wire.lengths[i] = share * length;
    wire.lengths.insert(wire.lengths.begin() + i + 1, length - share * length);
    wire.joints.insert(wire.joints.begin() + i, Vec3::Zero());
    const int station = wire.stations[i - 1];
    wire.stations.insert(wire.stations.begin() + i, station);
    if (!wire.twists.empty()) {
        const double twist = wire.twists[i];
        wire.twists[i] = share * twist;
        wire.twists.insert(wire.twists.begin() + i + 1, twist - share * twist);
    }
    if (!wire.grips.empty()) {
        Grip grip;
        grip.anchor = wire.grips[i - 1].anchor + share * (wire.grips[i].anchor - wire.grips[i - 1].anchor);
        wire.grips.insert(wire.grips.begin() + i, grip);
    }
    rebuild_joints(wire, i);
    assign_material(wire);
}

void merge_segments(Guidewire& wire, int i) {
    const Vec3 chord = wire.lengths[i] * wire.tangents[i] + wire.lengths[i + 1] * wire.tangents[i + 1];
    wire.tangents[i] = chord.normalized();
    wire.tangents.erase(wire.tangents.begin() + i + 1);
    wire.lengths[i] += wire.lengths[i + 1];
    // A segment made whole of its pieces is as it was before.
    const double lambda = wire.spec.segment_length;
    if (std::abs(wire.lengths[i] - lambda) < whole_segment * lambda) wire.lengths[i] = lambda;
    wire.lengths.erase(wire.lengths.begin() + i + 1);
    if (!wire.twists.empty()) {
        wire.twists[i] += wire.twists[i + 1];
        wire.twists.erase(wire.twists.begin() + i + 1);
    }
    if (!wire.grips.empty()) {
        wire.friction_loss += wire.grips[i].energy(wire.joints[i]);
        wire.grips.erase(wire.grips.begin() + i);
    }
    wire.joints.erase(wire.joints.begin() + i);
    wire.stations.erase(wire.stations.begin() + i);
    rebuild_joints(wire, i);
    assign_material(wire);
}

void insert_segment(Guidewire& wire) {
    assert(wire.grips.empty() && wire.twists.empty());
    const int before = wire.segments() - wire.curved_segments();  // last segment of the shaft
    const Vec3 u = wire.tangents[before];
    const double lambda = wire.spec.segment_length;
    wire.tangents.insert(wire.tangents.begin() + before + 1, u);
    wire.lengths.insert(wire.lengths.begin() + before + 1, lambda);
    wire.joints.insert(wire.joints.begin() + before + 1, Vec3::Zero());
    const int station = wire.stations[before];
    wire.stations.insert(wire.stations.begin() + before + 1, station);
    rebuild_joints(wire, before + 1);
    assign_material(wire);
}

bool remove_segment(Guidewire& wire) {
    assert(wire.grips.empty() && wire.twists.empty());
    int last = wire.segments() - wire.curved_segments();
    for (; wire.lengths[last] > 1.5 * wire.spec.segment_length; ++last) split_segment(wire, last);
    for (; wire.lengths[last] < wire.spec.segment_length * (1 - whole_segment); --last)
        merge_segments(wire, last - 1);
    if (last < 2) return false;
    wire.tangents.erase(wire.tangents.begin() + last);
    wire.lengths.erase(wire.lengths.begin() + last);
    wire.joints.erase(wire.joints.begin() + last);
    wire.stations.erase(wire.stations.begin() + last);
    rebuild_joints(wire, last);
    assign_material(wire);
    return true;
}

int move(Guidewire& wire, double mm) {
    // A sum of decimal steps that should make a whole segment does, in spite of rounding.
    const double lambda = wire.spec.segment_length, whole = lambda * (1 - 1e-9);
    int made = 0;
    wire.carried += mm;
    while (wire.carried >= whole) {
        insert_segment(wire);
        wire.carried -= lambda;
        ++made;
    }
    while (wire.carried <= -whole) {
        if (!remove_segment(wire)) {
            wire.carried = 0;  // the hub can't pull the tip out of the introducer
            break;
        }
        wire.carried += lambda;
        --made;
    }
    return made;
}

FeedPlan plan_feed(const Guidewire& wire, double mm) {
    FeedPlan plan;
    plan.grows = wire.segments() - wire.curved_segments();
    plan.mm = std::max(mm, std::min(0.0, least_length(wire.spec) - wire.inserted_length()));
    const int before = plan.grows - 1;
    const auto in_pieces = [&](int joint) { return joint >= 1 && wire.within_a_segment(joint); };
    plan.whole = !in_pieces(before) && !in_pieces(before - 1) && wire.lengths[plan.grows] > 0 &&
                 (before < 1 || wire.lengths[before] <= 1.5 * wire.spec.segment_length);
    const double left = wire.lengths[plan.grows] + plan.mm;
    if (plan.mm < 0 && before >= 1 && left < (0.5 - whole_segment) * wire.spec.segment_length) {
        const double both = wire.lengths[before] + wire.lengths[plan.grows];
        plan.change_before = plan.mm * wire.lengths[before] / both;
    }
    plan.change = plan.mm - plan.change_before;
    plan.whole = plan.whole && plan.change > -wire.lengths[plan.grows] * (1 - 1e-6);
    return plan;
}

std::vector<double> fed_twists(const Guidewire& wire, const FeedPlan& plan) {
    std::vector<double> twists = wire.twists;
    if (twists.empty()) return twists;
    const double fed = plan.change + plan.change_before;
    double place = 0, before = 0;  // of the new joint, and of the old one before the material there [mm]
    double sum = 0, last = 0;      // twist from the introducer to that joint, and to the new one before
    int from = 1;
    for (int j = 1; j < plan.grows; ++j) {
        place += wire.lengths[j];
        if (j == plan.grows - 1) place += plan.change_before;
        const double s = std::max(0.0, place - fed);
        for (; from < plan.grows && before + wire.lengths[from] < s; ++from) {
            before += wire.lengths[from];
            sum += wire.twists[from];
        }
        const double here = sum + std::min(1.0, (s - before) / wire.lengths[from]) * wire.twists[from];
        twists[j] = here - last;
        last = here;
    }
    double whole = 0;
    for (int j = 1; j <= plan.grows; ++j) whole += wire.twists[j];
    twists[plan.grows] = whole - last;
    return twists;
}

std::vector<Grip> fed_grips(const Guidewire& wire, const FeedPlan& plan, double& lost) {
    std::vector<Grip> grips = wire.grips;
    if (grips.empty()) return grips;
    // By the material's distance from the introducer; what comes in has been in front of it.
    double before = 0, place = 0;
    int from = 1;
    for (int j = 0; j < plan.grows; ++j) {
        if (j > 0) place += wire.lengths[j];
        if (j == plan.grows - 1) place += plan.change_before;
        const double s = place - plan.change - plan.change_before;
        for (; from < wire.segments() && before + wire.lengths[from] < s; ++from)
            before += wire.lengths[from];
        const double share = std::min(1.0, (s - before) / wire.lengths[from]);
        const auto along = [&](const Vec3& a, const Vec3& b) {
            return s < 0 ? Vec3(a + s * wire.tangents[0]) : Vec3(a + share * (b - a));
        };
        grips[j].anchor = along(wire.grips[from - 1].anchor, wire.grips[from].anchor);
        const double roll = wire.grips[from - 1].roll;
        grips[j].roll = s < 0 ? 0.0 : roll + share * (wire.grips[from].roll - roll);
        if (!grips[j].holds()) continue;
        Grip unmixed = grips[j];
        unmixed.anchor =
            along(wire.joints[from - 1], wire.joints[from]) + wire.grips[j].anchor - wire.joints[j];
        lost += unmixed.energy(wire.joints[j]) - grips[j].energy(wire.joints[j]);
    }
    return grips;
}

void apply_feed(Guidewire& wire, const FeedPlan& plan) {
    const double lambda = wire.spec.segment_length;
    wire.grips = fed_grips(wire, plan, wire.friction_loss);
    wire.twists = fed_twists(wire, plan);
    int grows = plan.grows;
    wire.lengths[grows] += plan.change;
    if (plan.change_before != 0) wire.lengths[grows - 1] += plan.change_before;
    // On the way out two segments have become shorter: they become one, or a whole one and a rest.
    if (plan.change_before != 0) merge_segments(wire, --grows);
    for (; wire.lengths[grows] >= (1.5 - whole_segment) * lambda; ++grows) {
        split_segment(wire, grows, lambda / wire.lengths[grows]);
        wire.lengths[grows] = lambda;
    }
    rebuild_joints(wire, std::max(1, plan.grows - 1));
    assign_material(wire);
}

double feed(Guidewire& wire, double mm) {
    const double lambda = wire.spec.segment_length;
    const auto make_whole = [&](int i) {  // of its pieces
        while (i > 1 && wire.within_a_segment(i - 1)) merge_segments(wire, --i);
        return i;
    };
    double fed = 0;
    for (;;) {
        int last = make_whole(wire.segments() - wire.curved_segments());
        if (last > 1) {
            int before = make_whole(last - 1);
            for (; wire.lengths[before] > 1.5 * lambda; ++before) split_segment(wire, before);
        }
        const double part = std::clamp(mm - fed, -lambda, lambda);
        const FeedPlan plan = plan_feed(wire, part);
        if (plan.mm == 0) return fed;
        apply_feed(wire, plan);
        fed += plan.mm;
        if (plan.mm != part || std::abs(mm - fed) < 1e-12 * lambda) return fed;
    }
}

void rotate(Guidewire& wire, double angle) {
    if (wire.windup_stiffness() > 0) {
        wire.windup += angle;
        return;
    }
    wire.roll = std::remainder(wire.roll + angle, 2 * M_PI);
    if (!wire.twists.empty()) hold_frames(wire, angle);
}

void rebuild_joints(Guidewire& wire, int first) {
    for (int i = std::max(first, 1); i <= wire.segments(); ++i)
        wire.joints[i] = wire.joints[i - 1] + wire.lengths[i] * wire.tangents[i];
}

Vec3 rolled_director(const Guidewire& wire) {
    const Vec3& u = wire.tangents[0];
    return std::cos(wire.roll) * wire.base_director + std::sin(wire.roll) * u.cross(wire.base_director);
}

void transport_directors(const Guidewire& wire, int first, std::vector<Vec3>& d) {
    for (int i = first; i <= wire.segments(); ++i) {
        const Vec3 &from = wire.tangents[i - 1], &to = wire.tangents[i];
        const double k = 1 + from.dot(to);
        Vec3 next = d[i - 1];
        if (k > 1e-9) next -= next.dot(to) / k * (from + to);  // smallest rotation that takes from to to
        next -= next.dot(to) * to;
        d[i] = next.normalized();
        if (!wire.twists.empty() && wire.twists[i] != 0)
            d[i] = std::cos(wire.twists[i]) * d[i] + std::sin(wire.twists[i]) * to.cross(d[i]);
    }
}

std::vector<Vec3> directors(const Guidewire& wire) {
    std::vector<Vec3> d(wire.joints.size());
    d[0] = rolled_director(wire);
    transport_directors(wire, 1, d);
    return d;
}

std::vector<std::string> validate(const Guidewire& wire) {
    std::vector<std::string> out;
    const std::size_t n = wire.joints.size();
    if (n < 2 || wire.tangents.size() != n || wire.lengths.size() != n || wire.rigidity.size() != n ||
        wire.rest_angle.size() != n || wire.stations.size() != n)
        return {"the wire's arrays differ in length"};
    if (!std::isfinite(wire.roll) || !std::isfinite(wire.carried) || !wire.load.allFinite())
        out.push_back("roll, carried or load is not finite");
    if (!wire.twists.empty() && wire.twists.size() != n) out.push_back("the wire's twists differ in number");
    for (const double twist : wire.twists)
        if (!std::isfinite(twist)) out.push_back("a twist is not finite");
    for (std::size_t i = 0; i < n; ++i) {
        const std::string at = " " + std::to_string(i);
        if (!wire.joints[i].allFinite()) out.push_back("joint" + at + " is not finite");
        if (!(std::abs(wire.tangents[i].norm() - 1) <= 1e-12)) out.push_back("tangent" + at + " is not unit");
        if (i == 0) continue;
        const double apart = (wire.joints[i] - wire.joints[i - 1]).norm();
        if (!(std::abs(apart - wire.lengths[i]) <= 1e-9))
            out.push_back("joint" + at + " is not λ from the last");
    }
    return out;
}

}  // namespace physics

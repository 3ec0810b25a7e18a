#include "physics/wire/chain.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "physics/geometry/maths.h"

namespace physics {
namespace {

/// Lengths are whole numbers of λ to this fraction of it, in spite of rounding.
constexpr double whole_segment = 1e-9;

std::string joined(const std::vector<std::string>& sentences) {
    std::string text;
    for (const std::string& s : sentences) text += (text.empty() ? "" : " ") + s;
    return text;
}

/// A piece of the chain along which no device changes but by its taper: what the devices have there.
struct Piece {
    double from = 0, to = 0;  // from the introducer [mm]
    double whole = 0;         // EI of all [N·mm²]
    std::array<double, most_devices> rigidity = {};
    std::array<Vec2, most_devices> curvature = {};  // at rest, in the device's own two planes [1/mm]
};

/// Walks along a chain from the introducer, from piece to piece.
class Pieces {
public:
    explicit Pieces(const Chain& chain) : devices_(chain.devices) {
        for (const Device& device : devices_) {
            double s = device.inserted;
            ends_.push_back(s);
            for (const StiffnessSection& section : device.spec.sections)
                if ((s -= section.length) > 0 && section.length > 0) ends_.push_back(s);
            for (const Bulge& bulge : device.bulge)
                for (const double end : {bulge.from_tip, bulge.from_tip + bulge.length()})
                    if (end > 0 && device.inserted > end) ends_.push_back(device.inserted - end);
            s = device.inserted;
            for (const RestArc& arc : device.spec.shape)
                if ((s -= arc.length) > 0) ends_.push_back(s);
        }
        std::sort(ends_.begin(), ends_.end());
    }

    /// The piece from `from` as far as `to` at most; both grow from call to call.
    const Piece& next(double from, double to) {
        assert(to >= from && devices_.size() <= most_devices);
        while (at_ < ends_.size() && ends_[at_] <= from) ++at_;
        piece_.from = from;
        piece_.to = at_ < ends_.size() ? std::min(to, ends_[at_]) : to;
        assert(piece_.to > from || to == from);  // each call comes farther
        const double middle = 0.5 * (from + piece_.to);
        // Between two ends only tapers change anything.
        if (at_ == known_ && !tapers_) return piece_;
        // The middle of a piece that is only rounding may round to the piece before.
        constexpr double rounding = 1e-9;  // [mm]
        known_ = piece_.to - from > rounding ? at_ : unknown;
        tapers_ = false;
        piece_.whole = 0;
        for (std::size_t k = 0; k < devices_.size(); ++k) {
            const Device& device = devices_[k];
            const double s = device.inserted - middle;  // from its distal end
            piece_.rigidity[k] = 0;
            piece_.curvature[k].setZero();
            if (s <= 0) continue;
            piece_.rigidity[k] = rigidity_at(device.spec, s);
            for (const Bulge& bulge : device.bulge)
                if (s > bulge.from_tip && s < bulge.from_tip + bulge.length())
                    piece_.rigidity[k] += bulge.rigidity;
            piece_.whole += piece_.rigidity[k];
            piece_.curvature[k] = curvature_at(device.spec, s);
            tapers_ = tapers_ || tapered_at(device.spec, s);
        }
        return piece_;
    }

private:
    static Vec2 curvature_at(const DeviceSpec& spec, double s) {
        for (const RestArc& arc : spec.shape) {
            if (s <= arc.length)
                return arc.angle / arc.length * Vec2(geometry::cos(arc.plane), geometry::sin(arc.plane));
            s -= arc.length;
        }
        return Vec2::Zero();
    }
    static bool tapered_at(const DeviceSpec& spec, double s) {
        for (std::size_t k = 0; k + 1 < spec.sections.size(); ++k) {
            const StiffnessSection& section = spec.sections[k];
            if (s <= section.length) return section.rigidity_distal != section.rigidity_proximal;
            s -= section.length;
        }
        const StiffnessSection& last = spec.sections.back();
        return s < last.length && last.rigidity_distal != last.rigidity_proximal;
    }

    const std::vector<Device>& devices_;
    std::vector<double> ends_;
    static constexpr std::size_t unknown = static_cast<std::size_t>(-1);
    std::size_t at_ = 0, known_ = unknown;
    bool tapers_ = true;
    Piece piece_;
};

/// Integrals under the tent of one joint.
struct Cell {
    double length = 0, give = 0, stored = 0;  // ∫w, ∫w/EI, ½∫w ΣEI_k κ_k²(1 − EI_k/EI)
    std::array<double, most_devices> covered = {}, fraction = {};  // ∫w where it is, ∫w EI_k/EI
    std::array<Vec2, most_devices> bend = {};                      // t_k
    /// ∫w EI_k EI_l/EI of κ_k·κ_l and κ_k × κ_l, for k < l.
    std::array<std::array<Vec2, most_devices>, most_devices> product = {};

    Cell() {
        bend.fill(Vec2::Zero());
        for (auto& row : product) row.fill(Vec2::Zero());
    }
    void add(const Piece& piece, double weight, std::size_t devices) {
        assert(weight > -1e-9 && piece.whole > 0 && devices <= most_devices);
        length += weight;
        give += weight / piece.whole;
        for (std::size_t k = 0; k < devices; ++k) {
            if (piece.rigidity[k] == 0) continue;
            const double part = piece.rigidity[k] / piece.whole;
            covered[k] += weight;
            fraction[k] += weight * part;
            const Vec2& a = piece.curvature[k];
            if (a.isZero(0)) continue;
            bend[k] += weight * part * a;
            stored += 0.5 * weight * piece.rigidity[k] * (1 - part) * a.squaredNorm();
            for (std::size_t l = k + 1; l < devices; ++l) {
                const Vec2& b = piece.curvature[l];
                product[k][l] += weight * part * piece.rigidity[l] * crossed(a, b);
            }
        }
    }
    static Vec2 crossed(const Vec2& a, const Vec2& b) { return {a.dot(b), a[0] * b[1] - a[1] * b[0]}; }
};

/// Gives a joint what its cell says.
void assign_joint(Chain& chain, int joint, const Cell& cell) {
    assert(joint >= 0 && joint <= chain.segments() && cell.length > 0 && cell.give > 0);
    const std::size_t devices = chain.devices.size();
    const double whole = cell.length / cell.give, length = chain.length_of(joint), spring = whole / length;
    assert(std::isfinite(spring) && spring > 0);
    // The devices' fractions of the stiffness are all of it.
    assert(std::abs(std::accumulate(cell.fraction.begin(), cell.fraction.end(), 0.0) - cell.length) <=
           1e-9 * cell.length);
    chain.rigidity[joint] = whole;
    double stored = length / cell.length * cell.stored;
    for (std::size_t k = 0; k < devices; ++k) {
        Device& device = chain.devices[k];
        const double fraction = cell.fraction[k] / cell.length;
        device.fraction[joint] = std::min(1.0, cell.covered[k] / cell.length);
        device.rigidity[joint] = fraction * whole;
        RestTurn& rest = device.rest[joint] = {};
        // With EndCells::Paper the first joint stands for twice its cell.
        const Vec2 bend = length / cell.length * cell.bend[k];
        const double angle = bend.norm();
        if (!(angle > 0)) continue;
        assert(fraction > 0 && fraction < 1 + 1e-9);
        rest.angle = angle / fraction;
        rest.cosine = geometry::cos(rest.angle), rest.sine = geometry::sin(rest.angle);
        rest.direction = bend / angle;
        stored += 0.5 * spring * angle * angle * (1 - 1 / fraction);
        for (std::size_t l = k + 1; l < devices; ++l) {
            // Turned by Δ against the first: κ_k·R(Δ)κ_l = cos Δ κ_k·κ_l − sin Δ κ_k × κ_l.
            const Vec2 other = length / cell.length * cell.bend[l];
            Vec2 by = spring * Cell::crossed(bend, other) - length / cell.length * cell.product[k][l];
            // In a joint along which nothing changes both are the same.
            constexpr double seen = 1e-12;
            if (by.norm() <= seen * spring * angle * other.norm()) continue;
            chain.couplings.push_back({joint, static_cast<int>(k), static_cast<int>(l), by[0], -by[1]});
        }
    }
    chain.stored[joint] = devices == 1 ? 0.0 : stored;
}

void assign_torsion(const Chain& chain, Device& device) {
    assert(!device.twists_by_segments() || device.wound.size() == chain.joints.size());
    device.windup_stiffness = 0;
    device.torsion.clear();
    if (!device.spec.twists()) return;
    if (device.twists_by_segments()) {
        device.torsion.assign(chain.joints.size(), 0.0);
        double a = 0;
        for (int j = 1; j <= chain.segments(); ++j) {
            const double b = a + chain.lengths[j], from = device.inserted - std::min(b, device.inserted),
                         to = device.inserted - a + (j == 1 ? device.outside : 0.0);
            // Distal of its end its frame goes on, and nothing turns it.
            const double most = 1e3 * torsional_rigidity_at(device.spec, 0) / chain.grid.segment_length;
            device.torsion[j] = to > from ? std::min(most, 1 / torsional_give(device.spec, from, to)) : most;
            a = b;
        }
    } else if (device.bends) {
        // A shaft that is hardly inside is as stiff as its first millimetres.
        constexpr double least_shaft = 2;  // [mm]
        const double shaped = shaped_length(device.spec);
        device.windup_stiffness =
            1 / torsional_give(device.spec, shaped,
                               std::max(shaped + least_shaft, device.inserted) + device.outside);
        assert(std::isfinite(device.windup_stiffness) && device.windup_stiffness > 0);
    }
}

}  // namespace

void assign_from(Chain& chain, int first) {
    const int n = chain.segments();
    const std::size_t devices = chain.devices.size();
    assert(devices >= 1 && devices <= most_devices && n >= 1 && first >= 0 && first <= n);
    for (std::vector<double>* list :
         {&chain.rigidity, &chain.stored, &chain.thickness, &chain.friction, &chain.static_friction})
        list->resize(n + 1);
    for (Device& device : chain.devices) {
        device.fraction.resize(n + 1);
        device.rigidity.resize(n + 1);
        device.rest.resize(n + 1);
    }
    std::erase_if(chain.couplings, [&](const Coupling& c) { return c.joint >= first; });
    // A taper is followed in steps of λ, also along coarser segments.
    const double longest = chain.grid.segment_length * (1 + 1e-6);
    Pieces pieces(chain);
    Cell cell, next;
    double a = 0;
    for (int j = 1; j < first; ++j) a += chain.lengths[j];
    for (int j = std::max(1, first); j <= n; ++j) {
        const double length = chain.lengths[j], b = a + length;
        for (double from = a; from < b;) {
            const Piece& piece = pieces.next(from, std::min(b, from + longest));
            const double distal = ((piece.to - a) * (piece.to - a) - (from - a) * (from - a)) / (2 * length);
            // What reaches past every device by rounding belongs to none.
            if (piece.whole > 0) {
                cell.add(piece, piece.to - from - distal, devices);
                next.add(piece, distal, devices);
            }
            from = piece.to;
        }
        if (j > first) assign_joint(chain, j - 1, cell);
        cell = next;
        next = {};
        a = b;
    }
    assign_joint(chain, n, cell);
    const double inner = chain.inner_radius();
    double along = 0;
    for (int j = 1; j <= first; ++j) along += chain.lengths[j];
    for (int j = first; j <= n; ++j) {
        if (j > first) along += chain.lengths[j];
        double radius = inner, friction = chain.devices[0].spec.friction,
               held = chain.devices[0].spec.holding_friction();
        for (const Device& device : chain.devices) {
            const double fraction = device.fraction[j];
            radius += fraction * (device.radius(device.inserted - along) - radius);
            friction += fraction * (device.spec.friction - friction);
            held += fraction * (device.spec.holding_friction() - held);
        }
        chain.thickness[j] = radius - inner;
        chain.friction[j] = friction;
        chain.static_friction[j] = std::max(friction, held);
    }
    chain.bent = 0;
    for (Device& device : chain.devices) {
        int joint = 0;
        while (joint < n && device.rest[joint].angle == 0) ++joint;
        device.bends = joint < n;
        chain.bent = std::max(chain.bent, n - joint);
        assign_torsion(chain, device);
    }
}

int first_fed(const Chain& chain, int which) {
    assert(which >= -1 && which < static_cast<int>(chain.devices.size()));
    double from = chain.inserted_length();
    for (int k = 0; k < static_cast<int>(chain.devices.size()); ++k)
        if (which == -1 || which == k)
            from = std::min(from, chain.devices[k].inserted - varying_length(chain.devices[k]));
    from -= chain.grid.segment_length;  // and as far as one feed reaches
    int joint = 0;
    for (double place = 0; joint < chain.segments(); ++joint)
        if ((place += chain.lengths[joint + 1]) >= from) break;
    return std::clamp(std::min(joint, chain.growing() - 2), 0, chain.segments());
}

void Chain::state(StateStream& s) {
    s(grid, devices, joints, tangents, lengths, stations, base_director, load, leading, tip_segments, carried,
      grips, vessels_stay, friction_loss, rubs, rub_loss);
    if (!s.restores() || joints.empty()) return;
    assign(*this);
    assert(validate(*this).empty());
}

double Chain::inserted_length() const {
    assert(lengths.size() == joints.size());
    double sum = 0;
    for (int i = 1; i <= segments(); ++i) sum += lengths[i];
    return sum;
}

int Chain::growing() const {
    assert(segments() >= 1 && lengths.size() == joints.size());
    double left = tip_segments * grid.segment_length * (1 - whole_segment);
    int i = segments();
    for (; i > 1 && left > 0; --i) left -= lengths[i];
    return i;
}

int Chain::bent_segments() const {
    assert(bent >= 0 && bent <= segments());
    for (const Device& device : devices)
        if (device.twists_by_segments()) return segments();
    return bent;
}

int Chain::outermost(double s) const {
    assert(!devices.empty() && std::isfinite(s));
    for (int k = static_cast<int>(devices.size()) - 1; k > 0; --k)
        if (devices[k].inserted > s - whole_segment) return k;
    return 0;
}

bool Chain::has_friction() const {
    return std::any_of(devices.begin(), devices.end(),
                       [](const Device& device) { return device.spec.holding_friction() > 0; });
}

bool Chain::sticks() const {
    return std::any_of(devices.begin(), devices.end(),
                       [](const Device& device) { return device.spec.sticks(); });
}

namespace {

/// Places of a chain's joints λ apart.
class WholePlaces {
public:
    explicit WholePlaces(const Chain& chain) : lambda_(chain.grid.segment_length) {
        for (int i = 1; i <= chain.segments(); ++i) whole_ += chain.lengths[i];
        // Where the tip begins, also in pieces.
        const double most = std::max(1.0, std::floor(whole_ / lambda_ - 0.5 + whole_segment));
        tip_begins_ = whole_ - std::min<double>(chain.tip_segments, most) * lambda_;
    }
    /// Whether none is at this distance from the introducer [mm].
    bool between(double place) const {
        const double slack = 1e-6 * lambda_;
        assert(place > 0 && place < whole_);
        if (place > tip_begins_ - slack) return !multiple(place - tip_begins_);
        const double last = std::max(0.0, std::floor(tip_begins_ / lambda_ - 0.5 + whole_segment)) * lambda_;
        return place > last + slack || !multiple(place);
    }

private:
    bool multiple(double length) const {
        return std::abs(length / lambda_ - std::round(length / lambda_)) < 1e-6;
    }

    double lambda_, whole_ = 0, tip_begins_ = 0;
};

}  // namespace

bool Chain::within_a_segment(int joint) const {
    if (joint < 1 || joint >= segments()) return false;
    double place = 0;
    for (int i = 1; i <= joint; ++i) place += lengths[i];
    return WholePlaces(*this).between(place);
}

std::vector<bool> Chain::within_segments() const {
    std::vector<bool> within(joints.size(), false);
    const WholePlaces places(*this);
    double place = 0;
    for (int j = 1; j < segments(); ++j) within[j] = places.between(place += lengths[j]);
    return within;
}

std::vector<std::string> problems(const std::vector<Device>& devices, const Grid& grid) {
    if (devices.empty() || devices.size() > most_devices)
        return {"expected 1 to " + std::to_string(most_devices) + " devices, found " +
                std::to_string(devices.size()) + '.'};
    std::vector<std::string> out;
    const double lambda = grid.segment_length;
    if (!(std::isfinite(lambda) && lambda > 0 && lambda <= DeviceLimits::segment_length))
        out.push_back("segment_length must lie in (0, " +
                      std::to_string(static_cast<int>(DeviceLimits::segment_length)) + "] mm.");
    for (const Device& device : devices) {
        for (std::string& text : problems(device.spec)) out.push_back(std::move(text));
        if (!(std::isfinite(device.inserted) && device.inserted >= 0))
            out.push_back("a device's length inside must be 0 mm or more.");
        for (const RestArc& arc : device.spec.shape)
            if (out.empty() && std::abs(arc.angle) * std::min(1.0, lambda / arc.length) > 1) {
                out.push_back("the shape turns by more than 57 degrees at a joint: use shorter segments.");
                break;
            }
    }
    return out;
}

namespace {

/// Index of the device that reaches farthest: `now` if it is among them.
int leader(const std::vector<Device>& devices, int now) {
    assert(now >= 0 && now < static_cast<int>(devices.size()));
    int best = now;
    for (std::size_t k = 0; k < devices.size(); ++k)
        if (devices[k].inserted > devices[best].inserted + whole_segment) best = static_cast<int>(k);
    return best;
}

/// Whole λ that go with the tip of a device with this shape.
int tip_segments_of(const Grid& grid, double shaped) {
    return std::max(grid.tip_segments, static_cast<int>(std::lround(shaped / grid.segment_length)));
}

/// Segments of a chain of this length whose leading device has this shape: whole ones, one that grows, and
/// the tip's.
struct Segments {
    int whole = 0, tip = 0;
    double growing = 0;  // [mm]
    Segments(const Grid& grid, double length, double shaped) {
        assert(grid.segment_length > 0 && length > 0 && shaped >= 0);
        const double lambda = grid.segment_length;
        const int most = std::max(1, static_cast<int>(std::floor(length / lambda - 0.5 + whole_segment)));
        tip = std::min(tip_segments_of(grid, shaped), most);
        whole = most - tip;
        growing = length - most * lambda;
        assert(whole >= 0 && growing < 1.5 * lambda);
    }
    int count() const { return whole + 1 + tip; }
};

/// Gives the chain the segments of its leading device, all joints at the first.
void give_segments(Chain& chain, double length) {
    assert(chain.leading >= 0 && chain.leading < static_cast<int>(chain.devices.size()));
    const double shaped = shaped_length(chain.devices[chain.leading].spec);
    const Segments segments(chain.grid, length, shaped);
    chain.tip_segments = tip_segments_of(chain.grid, shaped);
    const std::size_t joints = segments.count() + 1;
    // Copies: a vector's assign() must not be given a part of the vector.
    chain.joints.assign(joints, Vec3(chain.joints[0]));
    chain.tangents.assign(joints, Vec3(chain.tangents[0]));
    chain.stations.assign(joints, -1);
    chain.lengths.assign(joints, chain.grid.segment_length);
    chain.lengths[0] = 0;
    chain.lengths[segments.whole + 1] = segments.growing;
}

/// Puts the joints on the path, each a length of the chain's from the last.
void lay_along(Chain& chain, const Polyline& path) {
    assert(path.size() >= 2 && chain.lengths.size() == chain.joints.size());
    std::size_t piece = 1;
    for (int i = 1; i <= chain.segments(); ++i) {
        const Vec3 from = chain.joints[i - 1];
        const double reach = chain.lengths[i];
        Vec3 u = chain.tangents[i - 1];
        // The next point of the path that is far enough; past its end the path goes on straight.
        for (; piece < path.size(); ++piece) {
            if ((path[piece] - from).norm() < reach) continue;
            const Vec3 a = path[piece - 1] - from, d = path[piece] - path[piece - 1];
            const double dd = d.squaredNorm(), ad = a.dot(d), c = a.squaredNorm() - reach * reach;
            if (dd < 1e-24) continue;
            const double t = (-ad + std::sqrt(std::max(0.0, ad * ad - dd * c))) / dd;
            u = (a + t * d).normalized();
            break;
        }
        chain.tangents[i] = u;
        chain.joints[i] = from + reach * u;
        assert(std::abs(u.squaredNorm() - 1) < 1e-9);
    }
}

}  // namespace

void follow_leader(Chain& chain) {
    const int now = leader(chain.devices, chain.leading);
    if (now == chain.leading) return;
    chain.leading = now;
    const Chain old = chain;
    give_segments(chain, old.inserted_length());
    lay_along(chain, old.joints);
    chain.grips.assign(old.grips.empty() ? 0 : chain.joints.size(), {});
    for (Device& device : chain.devices)
        if (device.twists_by_segments()) device.wound.assign(chain.joints.size(), 0.0);
    double place = 0, passed = 0;  // of the joint, and of the old one before it [mm]
    int i = 1;
    for (int j = 0; j <= chain.segments(); ++j) {
        place += chain.lengths[j];
        for (; i < old.segments() && passed + old.lengths[i] < place; ++i) passed += old.lengths[i];
        const double fraction = std::clamp((place - passed) / old.lengths[i], 0.0, 1.0);
        chain.stations[j] = old.stations[fraction < 0.5 ? i - 1 : i];
        for (std::size_t k = 0; k < chain.devices.size(); ++k)
            if (const auto& wound = old.devices[k].wound; !wound.empty())
                chain.devices[k].wound[j] = wound[i - 1] + fraction * (wound[i] - wound[i - 1]);
        if (old.grips.empty()) continue;
        const Grip &a = old.grips[i - 1], &b = old.grips[i];
        Grip& grip = chain.grips[j] = fraction < 0.5 ? a : b;
        // Each holds its own stretch of the chain.
        const Vec3 before = a.anchor - old.joints[i - 1], after = b.anchor - old.joints[i];
        grip.anchor = chain.joints[j] + before + fraction * (after - before);
        grip.roll = a.roll + fraction * (b.roll - a.roll);
    }
    assign(chain);
    assert(std::abs(chain.inserted_length() - old.inserted_length()) < 1e-6);
}

Chain chain_along(std::vector<Device> devices, const Grid& grid, const Polyline& path) {
    if (const auto wrong = problems(devices, grid); !wrong.empty())
        throw std::invalid_argument(joined(wrong));
    if (path.size() < 2) throw std::invalid_argument("a wire's path needs at least two points");
    for (const Vec3& p : path)
        if (!p.allFinite()) throw std::invalid_argument("a wire's path has a point that is not finite");
    const Vec3 first = path[1] - path[0];
    if (first.norm() < 1e-12) throw std::invalid_argument("a wire's path starts with two equal points");
    Chain chain;
    chain.grid = grid;
    chain.devices = std::move(devices);
    chain.leading = leader(chain.devices, 0);
    const Device& longest = chain.devices[chain.leading];
    if (longest.inserted < least_length(grid) * (1 - whole_segment))
        throw std::invalid_argument("expected two segments inside, " + std::to_string(least_length(grid)) +
                                    " mm, found " + std::to_string(longest.inserted));
    chain.joints.assign(1, path[0]);
    chain.tangents.assign(1, first.normalized());
    give_segments(chain, longest.inserted);
    Vec3 other;
    tangent_basis(chain.tangents[0], chain.base_director, other);
    lay_along(chain, path);
    assign(chain);
    assert(validate(chain).empty());
    return chain;
}

Chain wire_along(const DeviceSpec& spec, const Grid& grid, const Polyline& path, int segments) {
    if (segments < 2)
        throw std::invalid_argument("expected two segments inside, found " + std::to_string(segments));
    Device device;
    device.spec = spec;
    device.inserted = segments * grid.segment_length;
    Chain chain = chain_along({std::move(device)}, grid, path);
    assert(chain.segments() == segments);
    return chain;
}

Chain straight_wire(const DeviceSpec& spec, const Grid& grid, const Vec3& entry, const Vec3& direction,
                    int segments) {
    const double length = direction.norm();
    if (!entry.allFinite() || !std::isfinite(length) || length < 1e-12)
        throw std::invalid_argument("a wire needs a finite entry and a direction that is not zero");
    const Vec3 along = (segments + 1) * grid.segment_length / length * direction;
    return wire_along(spec, grid, {entry, entry + along}, segments);
}

Chain uniform_wire(double rigidity, double segment_length, const Vec3& entry, const Vec3& clamped,
                   const std::vector<Vec3>& tangents, EndCells end_cells) {
    if (tangents.empty()) throw std::invalid_argument("a wire needs at least one segment");
    const int n = static_cast<int>(tangents.size());
    Device device;
    device.spec.sections = {{0, rigidity, rigidity}};
    device.inserted = n * segment_length;
    Chain chain;
    chain.grid = {segment_length, end_cells};
    chain.devices = {device};
    if (const auto wrong = problems(chain.devices, chain.grid); !wrong.empty())
        throw std::invalid_argument(joined(wrong));
    chain.joints.assign(n + 1, entry);
    chain.tangents.assign(n + 1, clamped.normalized());
    chain.lengths.assign(n + 1, segment_length);
    chain.lengths[0] = 0;
    chain.stations.assign(n + 1, -1);
    Vec3 other;
    tangent_basis(chain.tangents[0], chain.base_director, other);
    for (int i = 0; i < n; ++i) chain.tangents[i + 1] = tangents[i].normalized();
    rebuild_joints(chain);
    assign(chain);
    assert(validate(chain).empty());
    return chain;
}

void start_grips(Chain& chain, bool vessels_move) {
    chain.grips.clear();
    chain.friction_loss = 0;
    if (!chain.has_friction() && !vessels_move) return;
    chain.grips.resize(chain.joints.size());
    for (std::size_t i = 0; i < chain.joints.size(); ++i) chain.grips[i].anchor = chain.joints[i];
    assert(grip_energy(chain.grips, chain.joints, 0) == 0);
}

double twist_energy(const Chain& chain, int first) {
    assert(first >= 1);
    double energy = 0;
    for (const Device& device : chain.devices) {
        energy += device.windup_stiffness * device.windup * device.windup;
        for (std::size_t j = first; j < device.wound.size(); ++j) {
            const double twist = device.wound[j] - device.wound[j - 1];
            energy += device.torsion[j] * twist * twist;
        }
    }
    assert(energy >= 0);
    return 0.5 * energy;
}

namespace {

/// A length that is λ but for its rounding is λ.
double made_whole(const Chain& chain, double length) {
    const double lambda = chain.grid.segment_length;
    assert(length > 0);
    return std::abs(length - lambda) < whole_segment * lambda ? lambda : length;
}

/// Whether a device is bent at a joint at rest.
bool bent_at_rest(const Chain& chain, int joint) {
    assert(joint >= 0 && joint <= chain.segments());
    return std::any_of(chain.devices.begin(), chain.devices.end(),
                       [&](const Device& device) { return device.rest[joint].angle != 0; });
}

/// du/ds at a joint [1/mm].
struct Curvature {
    Vec3 all = Vec3::Zero(), by_load = Vec3::Zero();  // the latter of joints that are straight at rest alone
    Curvature(const Chain& chain, int joint) {
        if (joint == chain.segments()) return;
        all = (chain.tangents[joint + 1] - chain.tangents[joint]) / chain.length_of(joint);
        if (!bent_at_rest(chain, joint)) by_load = all;
    }
};

}  // namespace

void split_segment(Chain& chain, int i, double fraction) {
    assert(i >= 1 && i <= chain.segments() && fraction > 0 && fraction < 1);
    const Vec3 u = chain.tangents[i];
    const double length = chain.lengths[i];
    const Curvature before(chain, i - 1), after(chain, i);
    chain.tangents.insert(chain.tangents.begin() + i + 1, u);
    chain.lengths[i] = made_whole(chain, fraction * length);
    chain.lengths.insert(chain.lengths.begin() + i + 1, made_whole(chain, length - chain.lengths[i]));
    chain.joints.insert(chain.joints.begin() + i, Vec3::Zero());
    const int station = chain.stations[i - 1];
    chain.stations.insert(chain.stations.begin() + i, station);
    for (Device& device : chain.devices)
        if (device.twists_by_segments()) {
            const double from = device.wound[i - 1], at = from + fraction * (device.wound[i] - from);
            device.wound.insert(device.wound.begin() + i, at);
        }
    if (!chain.grips.empty()) {
        Grip grip;
        const Grip &a = chain.grips[i - 1], &b = chain.grips[i];
        grip.anchor = a.anchor + fraction * (b.anchor - a.anchor);
        grip.give = a.give + fraction * (b.give - a.give);
        grip.given = a.given + fraction * (b.given - a.given);
        grip.shift = a.shift + fraction * (b.shift - a.shift);
        grip.along = fraction < 0.5 ? a.along : b.along;
        grip.rested = std::min(a.rested, b.rested);
        chain.grips.insert(chain.grips.begin() + i, grip);
    }
    assign_from(chain, i - 1);
    Vec3 turn = 0.5 * chain.length_of(i) *
                (bent_at_rest(chain, i) ? before.all + after.all : before.by_load + after.by_load);
    turn -= turn.dot(u) * u;
    // The longer part turns less, so that the chord keeps its direction.
    chain.tangents[i] = (u - (1 - fraction) * turn).normalized();
    chain.tangents[i + 1] = (u + fraction * turn).normalized();
    rebuild_joints(chain, i);
    assert(validate(chain).empty());
}

void merge_segments(Chain& chain, int i) {
    assert(i >= 1 && i < chain.segments());
    const Vec3 chord = chain.lengths[i] * chain.tangents[i] + chain.lengths[i + 1] * chain.tangents[i + 1];
    assert(chord.norm() > 0);  // else they lie back on each other, and have no direction in common
    chain.tangents[i] = chord.normalized();
    chain.tangents.erase(chain.tangents.begin() + i + 1);
    chain.lengths[i] += chain.lengths[i + 1];
    chain.lengths[i] = made_whole(chain, chain.lengths[i]);
    chain.lengths.erase(chain.lengths.begin() + i + 1);
    for (Device& device : chain.devices)
        if (device.twists_by_segments()) device.wound.erase(device.wound.begin() + i);
    if (!chain.grips.empty()) {
        chain.friction_loss += chain.grips[i].energy(chain.joints[i]);
        chain.grips.erase(chain.grips.begin() + i);
    }
    chain.joints.erase(chain.joints.begin() + i);
    chain.stations.erase(chain.stations.begin() + i);
    rebuild_joints(chain, i);
    assign_from(chain, i - 1);
    assert(validate(chain).empty());
}

void rebuild_joints(Chain& chain, int first) {
    assert(chain.tangents.size() == chain.joints.size() && chain.lengths.size() == chain.joints.size());
    for (int i = std::max(first, 1); i <= chain.segments(); ++i)
        chain.joints[i] = chain.joints[i - 1] + chain.lengths[i] * chain.tangents[i];
}

void transport_directors(const Chain& chain, int first, std::vector<Vec3>& d) {
    assert(first >= 1 && d.size() == chain.joints.size());
    for (int i = first; i <= chain.segments(); ++i) {
        const Vec3 &from = chain.tangents[i - 1], &to = chain.tangents[i];
        const double k = 1 + from.dot(to);
        constexpr double turned_back = 1e-3;
        Vec3 next = d[i - 1];
        if (k > turned_back) {
            // The smallest rotation that takes from to to, and a Newton step to a length of 1.
            next -= next.dot(to) * (1 / k) * (from + to);
            d[i] = (1.5 - 0.5 * next.squaredNorm()) * next;
            assert(std::abs(d[i].squaredNorm() - 1) < 1e-6 && std::abs(d[i].dot(to)) < 1e-6);
            continue;
        }
        if (k > 1e-9) next -= next.dot(to) / k * (from + to);
        next -= next.dot(to) * to;
        d[i] = next.normalized();
    }
}

std::vector<Vec3> directors(const Chain& chain) {
    std::vector<Vec3> d(chain.joints.size());
    assert(std::abs(chain.base_director.dot(chain.tangents[0])) < 1e-6);
    d[0] = chain.base_director;
    transport_directors(chain, 1, d);
    return d;
}

std::vector<std::string> validate(const Chain& chain) {
    std::vector<std::string> out;
    const std::size_t n = chain.joints.size();
    if (chain.devices.empty() || chain.devices.size() > most_devices)
        return {"the chain carries no device, or too many"};
    bool alike = n >= 2 && chain.tangents.size() == n && chain.lengths.size() == n &&
                 chain.stations.size() == n && chain.rigidity.size() == n && chain.stored.size() == n &&
                 chain.thickness.size() == n && chain.friction.size() == n &&
                 chain.static_friction.size() == n && (chain.grips.empty() || chain.grips.size() == n);
    for (const Device& device : chain.devices)
        alike = alike && device.rest.size() == n && device.rigidity.size() == n &&
                (device.wound.empty() || (device.wound.size() == n && device.torsion.size() == n));
    if (!alike) return {"the chain's arrays differ in length"};
    if (!std::isfinite(chain.carried) || !chain.load.allFinite() || !std::isfinite(chain.friction_loss) ||
        !std::isfinite(chain.rub_loss))
        out.push_back("load, friction loss or motion carried over is not finite");
    for (const Rub& rub : chain.rubs)
        if (!(rub.slide + rub.moved + rub.force).allFinite() || !std::isfinite(rub.rested))
            out.push_back("friction between devices is not finite");
    if (!(std::abs(chain.base_director.norm() - 1) <= 1e-9) ||
        !(std::abs(chain.base_director.dot(chain.tangents[0])) <= 1e-9))
        out.push_back("the base director is not unit and across the entry direction");
    double longest = 0;
    for (const Device& device : chain.devices) {
        longest = std::max(longest, device.inserted);
        bool finite =
            std::isfinite(device.inserted) && std::isfinite(device.roll) && std::isfinite(device.windup);
        for (const double turn : device.wound) finite = finite && std::isfinite(turn);
        if (!finite) out.push_back("a device's place or turn is not finite");
        if (!(device.inserted >= 0)) out.push_back("a device is less than 0 mm inside");
    }
    if (chain.leading < 0 || chain.leading >= static_cast<int>(chain.devices.size()) ||
        chain.tip_segments < 0)
        out.push_back("the chain has no leading device");
    if (!(std::abs(longest - chain.inserted_length()) <= 1e-6))
        out.push_back("the chain is not as long as its longest device");
    for (std::size_t i = 0; i < n; ++i) {
        const std::string at = " " + std::to_string(i);
        if (!chain.joints[i].allFinite()) out.push_back("joint" + at + " is not finite");
        if (!(std::abs(chain.tangents[i].norm() - 1) <= 1e-12))
            out.push_back("tangent" + at + " is not unit");
        if (i + 1 < n && !(chain.rigidity[i] > 0)) out.push_back("joint" + at + " has no stiffness");
        if (i == 0) continue;
        if (!(chain.lengths[i] > 0)) out.push_back("segment" + at + " has no length");
        const double apart = (chain.joints[i] - chain.joints[i - 1]).norm();
        if (!(std::abs(apart - chain.lengths[i]) <= 1e-9))
            out.push_back("joint" + at + " is not λ from the last");
    }
    return out;
}

}  // namespace physics

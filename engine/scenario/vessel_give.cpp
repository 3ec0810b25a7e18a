#include "engine/scenario/vessel_give.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <tuple>
#include <utility>

#include "engine/io/text.h"
#include "physics/geometry/maths.h"

namespace scenario {
namespace {

using geometry::Vec3;

/// The wall's stiffness over the foundation's: in series they are 5 % softer than the latter, and a harder
/// wall takes more steps.
constexpr double harder = 20;
/// Of each node: two of the beam across the axis, two of the tube. A second difference joins three nodes.
constexpr int of_node = 4, band = 3 * of_node - 1;
constexpr int most_steps = 60, rounds = 3;
constexpr double settled = 0.01;     // of a step [mm]
constexpr double least_part = 1e-3;  // of Newton's step

using Across = Eigen::Matrix<double, 3, 2>;

/// A symmetric matrix with `band` entries beside the diagonal, and its solution.
class Banded {
public:
    explicit Banded(int size) : columns_(static_cast<std::size_t>(size + band)) {}
    double& at(int i, int j) { return i >= j ? columns_[j][i - j] : columns_[i][j - i]; }
    /// LDLᵀ in place, then the answer in place. Positive definite.
    void solve(std::vector<double>& right) {
        const int n = static_cast<int>(columns_.size()) - band;
        right.resize(columns_.size(), 0.0);
        for (int k = 0; k < n; ++k) {
            auto& own = columns_[k];
            const double each = 1 / own[0];
            for (int j = 1; j <= band; ++j) {
                const double fraction = own[j] * each;
                for (int i = j; i <= band; ++i) columns_[k + j][i - j] -= fraction * own[i];
                right[k + j] -= fraction * right[k];
            }
        }
        for (int k = n; k < n + band; ++k) right[k] = 0;
        for (int k = n - 1; k >= 0; --k) {
            for (int i = 1; i <= band; ++i) right[k] -= columns_[k][i] * right[k + i];
            right[k] /= columns_[k][0];
        }
        right.resize(static_cast<std::size_t>(n));
    }

private:
    std::vector<std::array<double, band + 1>> columns_;  // [j][k]: column j, k below the diagonal
};

class Problem {
public:
    Problem(const std::vector<TubeNode>& nodes, double step, bool clamped)
        : nodes_(nodes), step_(step), clamped_(clamped), unknown_(of_node * nodes.size(), 0.0) {
        lay_frames();
        for (const TubeNode& node : nodes) reached_ += node.rigidity > 0;
    }

    std::vector<double> solve() {
        for (int round = 0; round < rounds; ++round) {
            look_along();
            find_rest();
        }
        std::vector<double> aside;
        for (std::size_t i = 0; i < nodes_.size(); ++i)
            aside.push_back(geometry::hypot(unknown_[of_node * i + 2], unknown_[of_node * i + 3]));
        return aside;
    }

private:
    /// Lengths and directions of the beam as it lies, which are held while a rest is sought.
    void look_along() {
        lengths_.assign(1, step_);
        across_ = frames_;
        std::vector<Vec3> places;
        for (int i = 0; i < reached_; ++i)
            places.push_back(nodes_[i].centre +
                             frames_[i] * Eigen::Vector2d(unknown_[of_node * i], unknown_[of_node * i + 1]));
        for (int i = 1; i < reached_; ++i)
            lengths_.push_back(std::max(0.2 * step_, (places[i] - places[i - 1]).norm()));
        for (int i = 1; i + 1 < reached_; ++i) {
            const Vec3 along = (places[i + 1] - places[i - 1]).normalized(), side = along.unitOrthogonal();
            across_[i] << side, along.cross(side);
        }
    }

    void find_rest() {
        double energy = assemble(unknown_, nullptr, nullptr);
        for (int step = 0; step < most_steps; ++step) {
            Banded hessian(static_cast<int>(unknown_.size()));
            std::vector<double> descent(unknown_.size(), 0.0);
            assemble(unknown_, &descent, &hessian);
            hessian.solve(descent);
            double next = 0, largest = 0;
            std::vector<double> there;
            for (double part = 1; part > least_part; part *= 0.5) {
                there = unknown_;
                for (std::size_t k = 0; k < descent.size(); ++k) there[k] -= part * descent[k];
                next = assemble(there, nullptr, nullptr);
                if (next <= energy) break;
            }
            for (const double w : descent) largest = std::max(largest, std::abs(w));
            unknown_ = std::move(there);
            energy = next;
            if (largest < settled) break;
        }
    }

    /// Of what is held in the axis.
    double holding() const {
        return 1e3 * (nodes_[0].rigidity / (step_ * step_ * step_) + harder * nodes_[0].modulus * step_);
    }
    int count() const { return static_cast<int>(nodes_.size()); }

    /// Carried along the axis without turning about it.
    void lay_frames() {
        Vec3 side = Vec3::Zero();
        for (int i = 0; i < count(); ++i) {
            const Vec3 along =
                (nodes_[std::min(i + 1, count() - 1)].centre - nodes_[std::max(i - 1, 0)].centre)
                    .normalized();
            side -= side.dot(along) * along;
            if (side.norm() < 1e-6) side = along.unitOrthogonal();
            side.normalize();
            frames_.emplace_back();
            frames_.back() << side, along.cross(side);
        }
    }

    /// The energy; with what is asked for, adds its gradient and Hessian.
    double assemble(const std::vector<double>& at, std::vector<double>* gradient, Banded* hessian) const {
        double energy = 0;
        for (int i = 1; i + 1 < count(); ++i) {
            if (i + 1 < reached_) energy += bend(at, i, true, gradient, hessian);
            energy += bend(at, i, false, gradient, hessian);
        }
        for (int i = 0; i < count(); ++i) {
            const bool held = i >= reached_ || (clamped_ && i < 2);
            for (int k = 0; k < 2; ++k) {
                // What does not reach here, or is clamped, stays on the axis.
                if (held) energy += spring(at, of_node * i + k, holding(), gradient, hessian);
                energy += spring(at, of_node * i + 2 + k, nodes_[i].modulus * step_, gradient, hessian);
            }
            if (i < reached_) energy += touch(at, i, gradient, hessian);
        }
        return energy;
    }

    static double spring(const std::vector<double>& at, int k, double stiffness,
                         std::vector<double>* gradient, Banded* hessian) {
        if (gradient) (*gradient)[k] += stiffness * at[k];
        if (hessian) hessian->at(k, k) += stiffness;
        return 0.5 * stiffness * at[k] * at[k];
    }

    /// Of beam or tube at a node: what the directions of its two segments differ by, per length.
    double bend(const std::vector<double>& at, int i, bool beam, std::vector<double>* gradient,
                Banded* hessian) const {
        const double before = beam ? lengths_[i] : step_, behind = beam ? lengths_[i + 1] : step_,
                     cell = 0.5 * (before + behind),
                     stiffness = (beam ? nodes_[i].rigidity : nodes_[i].bending) * cell;
        const std::array<double, 3> weight = {1 / (before * cell), -(1 / before + 1 / behind) / cell,
                                              1 / (behind * cell)};
        const Across& across = beam ? across_[i] : frames_[i];
        const int shift = beam ? 0 : 2;
        Eigen::Matrix<double, 2, 6> jacobian;
        Vec3 bent = beam ? Vec3(-nodes_[i].rest) : Vec3(Vec3::Zero());
        for (int k = 0; k < 3; ++k) {
            const int node = i + k - 1, base = of_node * node + shift;
            bent += weight[k] * (frames_[node] * Eigen::Vector2d(at[base], at[base + 1]));
            if (beam) bent += weight[k] * nodes_[node].centre;
            jacobian.block<2, 2>(0, 2 * k) = weight[k] * across.transpose() * frames_[node];
        }
        const Eigen::Vector2d seen = across.transpose() * bent;
        const auto index = [&](int k) { return of_node * (i + k / 2 - 1) + shift + k % 2; };
        for (int k = 0; k < 6 && gradient; ++k)
            (*gradient)[index(k)] += stiffness * jacobian.col(k).dot(seen);
        for (int k = 0; k < 6 && hessian; ++k)
            for (int l = 0; l <= k; ++l)
                hessian->at(index(k), index(l)) += stiffness * jacobian.col(k).dot(jacobian.col(l));
        return 0.5 * stiffness * seen.squaredNorm();
    }

    double touch(const std::vector<double>& at, int i, std::vector<double>* gradient, Banded* hessian) const {
        const int base = of_node * i;
        const Eigen::Vector2d off(at[base] - at[base + 2], at[base + 1] - at[base + 3]);
        const double far = off.norm(), deep = far - nodes_[i].clearance,
                     k = harder * nodes_[i].modulus * step_;
        if (deep <= 0) return 0;
        const Eigen::Vector2d out = off / far;
        const Eigen::Matrix2d stiff =
            k * (out * out.transpose() + deep / far * (Eigen::Matrix2d::Identity() - out * out.transpose()));
        for (int a = 0; a < of_node && gradient; ++a)
            (*gradient)[base + a] += (a < 2 ? 1 : -1) * k * deep * out[a % 2];
        for (int a = 0; a < of_node && hessian; ++a)
            for (int b = 0; b <= a; ++b)
                hessian->at(base + a, base + b) += (a / 2 == b / 2 ? 1 : -1) * stiff(a % 2, b % 2);
        return 0.5 * k * deep * deep;
    }

    const std::vector<TubeNode>& nodes_;
    const double step_;
    const bool clamped_;
    int reached_ = 0;
    std::vector<Across> frames_;   // of the tube
    std::vector<Across> across_;   // of the beam as it lay when the round began
    std::vector<double> lengths_;  // of its segments then, [i] before node i [mm]
    std::vector<double> unknown_;
};

constexpr double step = 3;        // of nodes [mm]
constexpr double lead_step = 10;  // of how far tips are past each other [mm]
constexpr double tip_step = 4;    // of the places where a tip is tried [mm]
constexpr double past_tip = 30;   // of vessel that a tip's force is borne by [mm]
/// Where the beam is cut off from the rest of the device it is free, and presses as a tip does: so much does
/// not count [mm].
constexpr double cut = 40;
/// Stated is so many times what the beam does: with it 3 of 343 places are below what the whole chain does
/// there, without it a tenth, mostly by a fifth (docs/solver.md, section 8).
constexpr double margin = 1.5;
constexpr double turns = 20;  // over which a bend is looked at, where the tip is straight [mm]

struct Bend {
    double curvature = 0, plane = 0;  // [1/mm], [rad]
};
Bend shape_at(const physics::Device& device, double from_tip) {
    for (const physics::RestArc& arc : device.spec.shape) {
        if (from_tip < arc.length) return {arc.angle / arc.length, arc.plane};
        from_tip -= arc.length;
    }
    return {};
}

/// The curvature of the unloaded device in space, at a place of a way whose tangent and side are given.
Vec3 rest_of(const Bend& bend, const Vec3& along, const Vec3& side) {
    return bend.curvature *
           (geometry::cos(bend.plane) * side + geometry::sin(bend.plane) * along.cross(side));
}

using Place = VesselGives::Place;

/// Places at equal distances along stations from the first one on.
std::vector<Place> resampled(std::span<const geometry::Station> stations, const std::vector<int>& path,
                             double most) {
    std::vector<Place> places;
    double begin = 0;  // of the piece
    for (std::size_t k = 0; k + 1 < path.size() && begin <= most; ++k) {
        const Vec3 from = stations[path[k]].centre, piece = stations[path[k + 1]].centre - from;
        const double length = piece.norm();
        for (double next = step * static_cast<double>(places.size()); next < begin + length && next <= most;
             next = step * static_cast<double>(places.size()))
            places.push_back({from + (next - begin) / length * piece, path[k], 0});
        begin += length;
    }
    return places;
}

/// Means over a radius to both sides: what is across a bend sharper than the lumen is wide has no order along
/// the way.
std::vector<Place> rounded(std::span<const geometry::Station> stations, const std::vector<Place>& places) {
    std::vector<Place> round = places;
    const int count = static_cast<int>(places.size());
    for (int i = 0; i < count; ++i) {
        const int reach = std::min(
            {i, count - 1 - i, static_cast<int>(std::lround(stations[places[i].station].radius / step))});
        Vec3 sum = Vec3::Zero();
        for (int k = i - reach; k <= i + reach; ++k) sum += places[k].centre;
        round[i].centre = sum / (2 * reach + 1);
        round[i].off = (round[i].centre - places[i].centre).norm();
    }
    return round;
}

}  // namespace

std::vector<double> pushed_aside(const std::vector<TubeNode>& nodes, double step, bool clamped) {
    assert(nodes.size() >= 4 && nodes[0].rigidity > 0 && step > 0);
    return Problem(nodes, step, clamped).solve();
}

std::string vessels_sentence(const VesselGive& give, bool stay, bool as_asked) {
    if (give.branch.empty())
        return fmt::format("vessels {}{}: within reach devices push none aside",
                           stay ? "stay where they are" : "make way", as_asked ? " as asked" : "");
    return fmt::format("vessels {}{}: within reach devices can push '{}' aside by {} mm{}",
                       stay ? "stay where they are" : "make way", as_asked ? " as asked" : "", give.branch,
                       io::rounded_text(give.most, 2), stay ? ", which is left out" : "");
}

VesselGives::VesselGives(std::shared_ptr<const Reach> reach, std::vector<physics::Tissue> tissues,
                         const geometry::OpenEnd& entry)
    : reach_(std::move(reach)), tissues_(std::move(tissues)) {
    std::tie(before_, lengths_) = reach_->paths_from(entry);
}

VesselGive VesselGives::around(const physics::Chain& chain, double ahead, double enough) {
    VesselGive found;
    const int count = static_cast<int>(chain.devices.size());
    std::vector<int> tips;
    for (const physics::Device& device : chain.devices)
        tips.push_back(reach_->station_of(chain, device.inserted));
    for (int k = 0; k < count; ++k) {
        const double radius = 0.5 * chain.devices[k].spec.outer_diameter;
        for (const int s : reach_->near(tips[k], ahead)) {
            const Case wanted = case_of(k, s, tips, ahead);
            if (!is_tried(s) || reach_->stations()[s].radius < radius - geometry::centreline_error) continue;
            const auto [known, is_new] = known_.try_emplace(wanted);
            if (is_new) known->second = of(wanted, chain.devices);
            if (known->second.most > found.most) found = known->second;
            if (found.most > enough) return found;
        }
    }
    return found;
}

/// Of places less than tip_step apart one is tried.
bool VesselGives::is_tried(int station) const {
    const int before = before_[station];
    return lengths_[station] >= 0 && (before < 0 || std::floor(lengths_[station] / tip_step) !=
                                                        std::floor(lengths_[before] / tip_step));
}

VesselGives::Case VesselGives::case_of(int device, int station, const std::vector<int>& tips,
                                       double ahead) const {
    Case wanted{device, station, {}};
    for (std::size_t other = 0; other < tips.size(); ++other) {
        const double lead = lengths_[tips[other]] + ahead - lengths_[station];
        if (static_cast<int>(other) != device)
            wanted.leads[other] = static_cast<int>(std::ceil(std::clamp(lead, -500.0, 500.0) / lead_step));
    }
    return wanted;
}

/// From the tip back towards the entry, as far as the devices change along it and what is cut off after that.
std::vector<Place> VesselGives::path_back(int tip, const std::vector<physics::Device>& devices) const {
    double window = turns;
    for (const physics::Device& device : devices)
        window = std::max(window, physics::varying_length(device.spec));
    window += 2 * cut;
    std::vector<int> path;
    for (int s = tip; s >= 0 && lengths_[tip] - lengths_[s] <= window + step; s = before_[s])
        path.push_back(s);
    return rounded(reach_->stations(), resampled(reach_->stations(), path, window));
}

/// The vessels along places that are given from the tip back, in the order of the way in, and some vessel
/// past the tip.
std::vector<TubeNode> VesselGives::tube(const std::vector<Place>& places) const {
    const int count = static_cast<int>(places.size()), past = static_cast<int>(past_tip / step);
    const Vec3 onward = places[0].centre - places[1].centre;
    std::vector<TubeNode> nodes(static_cast<std::size_t>(count + past));
    for (int i = 0; i < count + past; ++i) {
        const int back = count - 1 - i;
        const Place& place = places[std::max(back, 0)];
        const geometry::Station& station = reach_->stations()[place.station];
        const physics::Tissue& tissue = tissues_[station.branch];
        TubeNode& node = nodes[i];
        node.centre = place.centre - std::min(back, 0) * onward;
        node.modulus = tissue.modulus;
        node.bending = std::numbers::pi * geometry::pow(station.radius, 4) * tissue.wall;
        // A branch begins within its parent's lumen.
        node.clearance = std::max(station.radius - place.off, reach_->room(place.centre, place.station));
    }
    return nodes;
}

/// Lays the devices in: shapes are turned away from the bend next to the tip, at worst.
void VesselGives::lay(const Case& wanted, const std::vector<physics::Device>& devices, int count,
                      std::vector<TubeNode>& nodes) const {
    double shaped = turns;
    for (const physics::Device& device : devices)
        shaped = std::max(shaped, physics::shaped_length(device.spec));
    const auto centre = [&](int back) { return nodes[count - 1 - std::clamp(back, 0, count - 1)].centre; };
    const int far = std::min(count - 1, static_cast<int>(shaped / step));
    Vec3 side = 2 * centre(far / 2) - centre(far) - centre(0);
    for (int back = 0; back < count; ++back) {
        TubeNode& node = nodes[count - 1 - back];
        const Vec3 along = (centre(back - 1) - centre(back + 1)).normalized();
        side -= side.dot(along) * along;
        if (side.norm() < 1e-6) side = along.unitOrthogonal();
        side.normalize();
        double thickest = 0;
        for (std::size_t k = 0; k < devices.size(); ++k) {
            const double from_tip = step * back + lead_step * wanted.leads[k];
            if (from_tip < 0) continue;
            const double rigidity = physics::rigidity_at(devices[k].spec, from_tip);
            node.rigidity += rigidity;
            node.rest += rigidity * rest_of(shape_at(devices[k], from_tip), along, side);
            thickest = std::max(thickest, 0.5 * devices[k].spec.outer_diameter);
        }
        node.rest /= node.rigidity;
        node.clearance = std::max(0.0, node.clearance - thickest);
    }
}

VesselGive VesselGives::of(const Case& wanted, const std::vector<physics::Device>& devices) const {
    const std::vector<Place> places = path_back(wanted.station, devices);
    const int count = static_cast<int>(places.size());
    if (count < 4) return {};
    std::vector<TubeNode> nodes = tube(places);
    lay(wanted, devices, count, nodes);
    const bool from_entry = lengths_[places.back().station] <= step;
    const std::vector<double> aside = pushed_aside(nodes, step, from_entry);
    VesselGive found;
    for (int i = from_entry ? 0 : static_cast<int>(cut / step); i < count; ++i)
        if (const double aside_most = margin * aside[i]; aside_most > found.most)
            found = {aside_most, reach_->name_of(places[count - 1 - i].station)};
    return found;
}

}  // namespace scenario

#include "engine/anatomy/grow/implicit_lumen.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/io/error.h"

namespace anatomy {
namespace {

constexpr double blend_width = 0.8;           // of the child's radius
constexpr double full_blend = 3, fading = 3;  // child's radii from the junction, and from full_blend on
constexpr int group_length = 16;              // samples
constexpr std::size_t most_blocks = 600'000;
// Keeps symmetric vessels from hitting nodes exactly.
const Vec3 offset(0.3719, 0.2183, 0.1327);

std::uint64_t key(const ImplicitLumen::Block& b) {
    const auto part = [](int i) { return static_cast<std::uint64_t>(i + (1 << 20)) & 0x1fffff; };
    return part(b[2]) << 42 | part(b[1]) << 21 | part(b[0]);
}

}  // namespace

ImplicitLumen::ImplicitLumen(const VesselTree& tree, double cell) : cell_(cell) {
    for (const SampledBranch& branch : tree.branches) {
        Limb limb;
        int before = 0;
        SampledBranch whole = extended(branch, before);
        limb.points = std::move(whole.points);
        limb.radii = std::move(whole.radii);
        const int last = static_cast<int>(limb.points.size()) - 1;
        for (int i = 0; i <= last; ++i) {
            const int a = std::max(0, i - 1), b = std::min(last, i + 1);
            limb.tangents.push_back((limb.points[b] - limb.points[a]) / (b - a));
            limb.radius_slopes.push_back((limb.radii[b] - limb.radii[a]) / (b - a));
        }
        const auto add_junction = [&](int at, int clear_at) {
            Limb::Junction junction;
            junction.place = branch.points[at];
            junction.blend = blend_width * branch.radii[at];
            const double clear = (branch.points[clear_at] - junction.place).norm();
            junction.full = std::max(full_blend * branch.radii[at], clear);
            junction.none = junction.full + fading * branch.radii[at];
            limb.blend = std::max(limb.blend, junction.blend);
            limb.junctions.push_back(junction);
        };
        if (branch.parent >= 0) add_junction(branch.exit, branch.separation);
        if (branch.joined >= 0) add_junction(branch.entry, branch.approach);
        for (int i = 0; i < last; ++i) {
            const double step = (limb.points[i + 1] - limb.points[i]).norm() +
                                std::max(limb.tangents[i].norm(), limb.tangents[i + 1].norm());
            const double rise =
                std::abs(limb.radii[i + 1] - limb.radii[i]) +
                std::max(std::abs(limb.radius_slopes[i]), std::abs(limb.radius_slopes[i + 1]));
            limb.dip = std::max(limb.dip, step + rise);
        }
        for (int first = 0; first <= last; first += group_length) {
            Limb::Group group{first, std::min(last, first + group_length - 1), 0, 0};
            group.middle = (group.first + group.last) / 2;
            for (int i = group.first; i <= group.last; ++i)
                group.reach = std::max(group.reach,
                                       (limb.points[i] - limb.points[group.middle]).norm() + limb.radii[i]);
            limb.groups.push_back(group);
        }
        limb.origin = limb.points[last / 2];
        for (int i = 0; i <= last; ++i) {
            if (i % 4 == 0) {
                limb.fours.emplace_back();
                Limb::Four& four = limb.fours.back();
                four.x.setConstant(1e15f), four.y.setZero(), four.z.setZero(), four.radius.setZero();
            }
            const Vec3 from = limb.points[i] - limb.origin;
            Limb::Four& four = limb.fours.back();
            four.x[i % 4] = static_cast<float>(from.x());
            four.y[i % 4] = static_cast<float>(from.y());
            four.z[i % 4] = static_cast<float>(from.z());
            four.radius[i % 4] = static_cast<float>(limb.radii[i]);
            limb.extent = std::max(limb.extent, from.lpNorm<1>() + limb.radii[i]);
        }
        limbs_.push_back(std::move(limb));
    }
    for (int b = 0; b < static_cast<int>(limbs_.size()); ++b)
        all_.push_back({b, 0, static_cast<int>(limbs_[b].points.size()) - 1, 0});
    make_blocks();
}

double ImplicitLumen::ball_distance(const Limb& limb, int sample, const Vec3& x) const {
    return (x - limb.points[sample]).norm() - limb.radii[sample];
}

/// Newton's method from the nearest ball of the samples to the nearest ball of the cubic between them. It
/// never goes to a farther ball, as it might inside a tight bend. The gradient of the least value is that of
/// its ball.
ImplicitLumen::Value ImplicitLumen::limb_value(const Limb& limb, int sample, const Vec3& x) const {
    const int last = static_cast<int>(limb.points.size()) - 1;
    const double low = std::max(0, sample - 1), high = std::min(last, sample + 1);
    double at = sample;
    Value value{ball_distance(limb, sample, x), Vec3::Zero(), limb.radii[sample]};
    for (int iteration = 0; iteration < 6; ++iteration) {
        const int i = std::min(last - 1, static_cast<int>(at));
        const double t = at - i, t2 = t * t, t3 = t2 * t;
        const Vec3 chord = limb.points[i + 1] - limb.points[i], &from = limb.tangents[i],
                   &to = limb.tangents[i + 1];
        const double rise = limb.radii[i + 1] - limb.radii[i], rise_from = limb.radius_slopes[i],
                     rise_to = limb.radius_slopes[i + 1];
        const auto hermite = [&](double of_chord, double of_from, double of_to) {
            return std::pair<Vec3, double>(of_chord * chord + of_from * from + of_to * to,
                                           of_chord * rise + of_from * rise_from + of_to * rise_to);
        };
        const auto [moved, widened] = hermite(3 * t2 - 2 * t3, t3 - 2 * t2 + t, t3 - t2);
        const Vec3 away = x - limb.points[i] - moved;
        const double length = away.norm(), radius = limb.radii[i] + widened;
        if (length - radius > value.distance + 1e-12) {  // back towards the last one
            if (iteration == 0) break;
            at = 0.5 * (at + value.place);
            continue;
        }
        const double place = at;
        value = {length - radius, length > 1e-12 ? Vec3(away / length) : Vec3::UnitX(), radius, place};
        const auto [slope, widening] = hermite(6 * t - 6 * t2, 3 * t2 - 4 * t + 1, 3 * t2 - 2 * t);
        const auto [bend, unused] = hermite(6 - 12 * t, 6 * t - 4, 6 * t - 2);
        const double along = value.gradient.dot(slope);
        const double curvature =
            (slope.squaredNorm() - along * along) / std::max(length, 1e-6) - value.gradient.dot(bend);
        if (curvature <= 0) break;
        at = std::clamp(at + (along + widening) / curvature, low, high);
        if (std::abs(at - place) < 1e-7) break;
    }
    return value;
}

/// Finds the first of the nearest balls of a run, if it is nearer than those before. Single precision rules
/// most out.
void ImplicitLumen::search(const Run& run, const Vec3& x, Near& near) const {
    const Limb& limb = limbs_[run.limb];
    const Eigen::Vector3f from = (x - limb.origin).cast<float>();
    const auto rounding = static_cast<float>(1e-6 * (limb.extent + (x - limb.origin).lpNorm<1>()));
    for (int f = run.first / 4; f <= run.last / 4; ++f) {
        const Limb::Four& four = limb.fours[f];
        const Eigen::Array4f dx = from.x() - four.x, dy = from.y() - four.y, dz = from.z() - four.z;
        const Eigen::Array4f most = (four.radius + static_cast<float>(near.distance)).max(0.0f) + rounding;
        const Eigen::Array4f beyond = dx * dx + dy * dy + dz * dz - most * most * (1 + 1e-6f);
        if (beyond.minCoeff() > 0) continue;
        const int last = std::min(run.last, 4 * f + 3);
        for (int i = std::max(run.first, 4 * f); i <= last; ++i) {
            if (beyond[i - 4 * f] > 0) continue;
            const double distance = ball_distance(limb, i, x);
            if (distance < near.distance || (distance == near.distance && i < near.sample))
                near.distance = distance, near.sample = i;
        }
    }
}

ImplicitLumen::Value ImplicitLumen::evaluate(const Vec3& x, std::span<const Run> runs) const {
    Value united;
    bool any = false;
    Near first;  // not evaluated unless another limb leaves open whether it matters
    for (std::size_t k = 0; k < runs.size();) {
        Near near{runs[k].limb, runs[k].guess};
        const Limb& limb = limbs_[near.limb];
        near.distance = ball_distance(limb, near.sample, x);
        for (; k < runs.size() && runs[k].limb == near.limb; ++k) {
            search(runs[k], x, near);
        }
        // Limbs farther apart than the width of the smooth minimum do not affect each other.
        const auto beyond = [&limb](double far, double dip, double distance) {
            return far - dip - 1e-6 > distance + limb.blend;
        };
        if (!any && first.limb < 0) {
            first = near;
            continue;
        }
        if (!any) {
            if (beyond(near.distance, limb.dip, first.distance)) continue;
            const Limb& other = limbs_[first.limb];
            any = true;
            if (beyond(first.distance, other.dip, near.distance)) {
                united = limb_value(limb, near.sample, x);
                continue;
            }
            united = limb_value(other, first.sample, x);
        }
        if (beyond(near.distance, limb.dip, united.distance)) continue;
        unite(united, limb_value(limb, near.sample, x), limb, x);
    }
    return any ? united : limb_value(limbs_[first.limb], first.sample, x);
}

void ImplicitLumen::unite(Value& united, const Value& value, const Limb& limb, const Vec3& x) const {
    double width = 0;
    double widening = 0;  // slope of the width, along `away` from the junction
    Vec3 away = Vec3::Zero();
    for (const Limb::Junction& junction : limb.junctions) {
        const Vec3 from = x - junction.place;
        const double far = from.norm(), span = junction.none - junction.full;
        const double t = std::clamp((junction.none - far) / span, 0.0, 1.0);
        const double own = junction.blend * t * t * (3 - 2 * t);
        if (own <= width) continue;
        width = own;
        widening = t < 1 ? junction.blend * 6 * t * (1 - t) * (-1 / span) : 0;
        if (t < 1) away = from / far;
    }
    const double apart = value.distance - united.distance;
    const Value& lesser = apart < 0 ? value : united;
    if (std::abs(apart) >= width) {
        united = Value(lesser);
        return;
    }
    // Cubic smooth minimum: min − w h³/6 with h = (w − |apart|)/w.
    const double h = (width - std::abs(apart)) / width, half = 0.5 * h * h;
    const Value& greater = apart < 0 ? united : value;
    Value smooth;
    smooth.distance = lesser.distance - width * h * h * h / 6;
    smooth.gradient = (1 - half) * lesser.gradient + half * greater.gradient;
    if (widening != 0) smooth.gradient -= (half - h * h * h / 3) * widening * away;
    // The blend is a saddle about as narrow as the child.
    smooth.radius = std::min(lesser.radius, greater.radius);
    united = smooth;
}

ImplicitLumen::Value ImplicitLumen::at(const Vec3& x, int block) const {
    const auto first = static_cast<std::size_t>(first_run_[block]);
    return evaluate(x, std::span(runs_).subspan(first, first_run_[block + 1] - first));
}

ImplicitLumen::Value ImplicitLumen::at(const Vec3& x) const {
    const double edge = block_cells * cell_;
    const Vec3 p = x / edge - offset;
    const int block = find({static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y())),
                            static_cast<int>(std::floor(p.z()))});
    return block < 0 ? evaluate(x, all_) : at(x, block);
}

ImplicitLumen::Foot ImplicitLumen::foot(const Vec3& from) const {
    Vec3 x = from;
    for (int iteration = 0; iteration < 12; ++iteration) {
        const Value value = at(x);
        const double slope = value.gradient.squaredNorm();
        if (std::abs(value.distance) < 1e-7 || slope < 1e-6) return {x, value};
        const Vec3 step = -value.distance / slope * value.gradient;
        x += step * std::min(1.0, cell_ / step.norm());
    }
    return {x, at(x)};
}

int ImplicitLumen::find(const Block& block) const {
    const auto at = index_.find(key(block));
    return at == index_.end() ? -1 : at->second;
}

Vec3 ImplicitLumen::node(const Block& block, int x, int y, int z) const {
    const Vec3 cells(block[0] * block_cells + x, block[1] * block_cells + y, block[2] * block_cells + z);
    return cell_ * (cells + block_cells * offset);
}

Vec3 ImplicitLumen::beyond_end(int branch, bool start) const {
    return start ? limbs_[branch].points.front() : limbs_[branch].points.back();
}

/// Collects from each limb the samples that may hold, anywhere within `reach` of the centre, the nearest ball
/// or one that still affects the smooth minimum.
void ImplicitLumen::collect_runs(const Vec3& centre, double reach, std::vector<Run>& runs) const {
    std::vector<Near> nearest(limbs_.size());
    double least_of_all = std::numeric_limits<double>::infinity();
    // No ball of the group is nearer.
    const auto bound = [&centre](const Limb& limb, const Limb::Group& group) {
        return (centre - limb.points[group.middle]).norm() - group.reach - 1e-6;
    };
    for (std::size_t b = 0; b < limbs_.size(); ++b) {
        const Limb& limb = limbs_[b];
        Near& near = nearest[b];
        near.distance = std::numeric_limits<double>::infinity();
        for (const Limb::Group& group : limb.groups) {
            if (bound(limb, group) > near.distance) continue;
            for (int i = group.first; i <= group.last; ++i) {
                const double distance = ball_distance(limb, i, centre);
                if (distance < near.distance) near.distance = distance, near.sample = i;
            }
        }
        least_of_all = std::min(least_of_all, near.distance);
    }
    for (int b = 0; b < static_cast<int>(limbs_.size()); ++b) {
        const Limb& limb = limbs_[b];
        double blend = limb.blend;
        for (const Limb& other : limbs_) blend = std::max(blend, other.blend);
        if (nearest[b].distance > least_of_all + 2 * reach + blend) continue;
        const double most = nearest[b].distance + 2 * reach;
        for (const Limb::Group& group : limb.groups) {
            if (bound(limb, group) > most) continue;
            for (int i = group.first; i <= group.last; ++i) {
                if (ball_distance(limb, i, centre) > most) continue;
                if (!runs.empty() && runs.back().limb == b && runs.back().last == i - 1)
                    runs.back().last = i;
                else
                    runs.push_back({b, i, i, nearest[b].sample});
            }
        }
    }
}

void ImplicitLumen::make_blocks() {
    const double edge = block_cells * cell_;
    // A node of a cell with both signs is within the cell's diagonal of the surface; another diagonal is
    // added for nodes that surface nets fill.
    const double half_diagonal = 0.5 * std::sqrt(3.0) * edge, diagonal = 2 * std::sqrt(3.0) * cell_;
    const double farthest = 1.1 * (half_diagonal + diagonal);  // f at the centre of a block [mm]
    std::vector<Block> near;
    for (const Limb& limb : limbs_) {
        std::vector<Block> of_limb;
        for (std::size_t i = 0; i < limb.points.size(); ++i) {
            const Vec3 reach = Vec3::Constant(limb.radii[i] + 2 * cell_ + limb.blend);
            const Vec3 low = (limb.points[i] - reach) / edge - offset,
                       high = (limb.points[i] + reach) / edge - offset;
            Block block;
            for (block[2] = static_cast<int>(std::floor(low.z())); block[2] <= std::floor(high.z());
                 ++block[2])
                for (block[1] = static_cast<int>(std::floor(low.y())); block[1] <= std::floor(high.y());
                     ++block[1])
                    for (block[0] = static_cast<int>(std::floor(low.x())); block[0] <= std::floor(high.x());
                         ++block[0]) {
                        const double distance =
                            ball_distance(limb, static_cast<int>(i), node(block, 4, 4, 4));
                        if (distance < edge + 2 * cell_ + limb.blend && distance > -farthest - 1e-6)
                            of_limb.push_back(block);
                    }
            if (of_limb.size() < most_blocks && i + 1 < limb.points.size()) continue;
            std::ranges::sort(of_limb);
            of_limb.erase(std::unique(of_limb.begin(), of_limb.end()), of_limb.end());
            if (of_limb.size() > most_blocks) {
                throw io::InputError(
                    "the vessels are too large for their smallest radius; expected a grid of at most " +
                    std::to_string(most_blocks) + " blocks");
            }
        }
        near.insert(near.end(), of_limb.begin(), of_limb.end());
    }
    const auto by_z = [](const Block& a, const Block& b) {
        return std::array{a[2], a[1], a[0]} < std::array{b[2], b[1], b[0]};
    };
    std::ranges::sort(near, by_z);
    near.erase(std::unique(near.begin(), near.end()), near.end());

    std::vector<Run> runs;
    for (const Block& block : near) {
        const Vec3 centre = node(block, block_cells / 2, block_cells / 2, block_cells / 2);
        runs.clear();
        collect_runs(centre, half_diagonal + cell_, runs);
        if (std::abs(evaluate(centre, runs).distance) > farthest) continue;
        index_.emplace(key(block), static_cast<int>(blocks_.size()));
        blocks_.push_back(block);
        first_run_.push_back(static_cast<int>(runs_.size()));
        runs_.insert(runs_.end(), runs.begin(), runs.end());
    }
    first_run_.push_back(static_cast<int>(runs_.size()));
}

}  // namespace anatomy

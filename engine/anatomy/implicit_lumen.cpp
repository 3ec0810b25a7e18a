#include "engine/anatomy/implicit_lumen.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/error.h"

namespace engine {
namespace {

using physics::Polyline;
using physics::Vec3;

constexpr double blend_width = 0.8;             // of the child's radius
constexpr double full_blend = 3, no_blend = 6;  // child's radii from the junction
constexpr double extension = 1.5;               // of an open end, in radii
constexpr std::size_t most_blocks = 600'000;
// Keeps symmetric vessels from meeting nodes exactly.
const Vec3 offset(0.3719, 0.2183, 0.1327);

std::uint64_t key(const ImplicitLumen::Block& b) {
    const auto part = [](int i) { return static_cast<std::uint64_t>(i + (1 << 20)) & 0x1fffff; };
    return part(b[2]) << 42 | part(b[1]) << 21 | part(b[0]);
}

}  // namespace

ImplicitLumen::ImplicitLumen(const VesselTree& tree, double cell) : cell_(cell) {
    for (const SampledBranch& branch : tree.branches) {
        Limb limb;
        const auto extend = [&](const Vec3& end, const Vec3& outward, double radius) {
            const int count = static_cast<int>(std::ceil((extension * radius + 2 * cell) / branch.step()));
            std::vector<Vec3> further;
            for (int i = 1; i <= count; ++i) further.push_back(end + i * branch.step() * outward);
            return further;
        };
        if (branch.parent < 0) {
            const Polyline before = extend(branch.points.front(), -branch.tangent(0), branch.radii.front());
            limb.points.assign(before.rbegin(), before.rend());
            limb.radii.assign(before.size(), branch.radii.front());
        }
        limb.points.insert(limb.points.end(), branch.points.begin(), branch.points.end());
        limb.radii.insert(limb.radii.end(), branch.radii.begin(), branch.radii.end());
        if (!branch.closed) {
            const int last = static_cast<int>(branch.points.size()) - 1;
            const Polyline after = extend(branch.points.back(), branch.tangent(last), branch.radii.back());
            limb.points.insert(limb.points.end(), after.begin(), after.end());
            limb.radii.insert(limb.radii.end(), after.size(), branch.radii.back());
        }
        const int last = static_cast<int>(limb.points.size()) - 1;
        for (int i = 0; i <= last; ++i) {
            const int a = std::max(0, i - 1), b = std::min(last, i + 1);
            limb.tangents.push_back((limb.points[b] - limb.points[a]) / (b - a));
            limb.radius_slopes.push_back((limb.radii[b] - limb.radii[a]) / (b - a));
        }
        if (branch.parent >= 0) {
            const SampledBranch& parent = tree.branches[branch.parent];
            int out = 0;  // where the centreline leaves the parent's lumen
            for (; out < branch.separation; ++out) {
                double least = std::numeric_limits<double>::infinity();
                for (std::size_t i = 0; i < parent.points.size(); ++i)
                    least = std::min(least, (parent.points[i] - branch.points[out]).norm() - parent.radii[i]);
                if (least >= 0) break;
            }
            limb.junction = branch.points[out];
            limb.blend = blend_width * branch.radii[out];
            limb.reach = branch.radii[out];
        }
        limbs_.push_back(std::move(limb));
    }
    for (int b = 0; b < static_cast<int>(limbs_.size()); ++b)
        all_.push_back({b, 0, static_cast<int>(limbs_[b].points.size()) - 1});
    make_blocks();
}

double ImplicitLumen::ball_distance(const Limb& limb, int sample, const Vec3& x) const {
    return (x - limb.points[sample]).norm() - limb.radii[sample];
}

/// Newton from the nearest ball of the samples to the nearest ball of the cubic between them; the gradient of
/// the least value is that of the ball it is taken at.
ImplicitLumen::Value ImplicitLumen::limb_value(const Limb& limb, int sample, const Vec3& x) const {
    const int last = static_cast<int>(limb.points.size()) - 1;
    double at = sample;
    const double low = std::max(0, sample - 1), high = std::min(last, sample + 1);
    Value value;
    for (int iteration = 0;; ++iteration) {
        const int i = std::min(last - 1, static_cast<int>(at));
        const double t = at - i, t2 = t * t, t3 = t2 * t;
        const double a = 2 * t3 - 3 * t2 + 1, b = t3 - 2 * t2 + t, c = 1 - a, d = t3 - t2;
        const Vec3 centre =
            a * limb.points[i] + b * limb.tangents[i] + c * limb.points[i + 1] + d * limb.tangents[i + 1];
        const double radius = a * limb.radii[i] + b * limb.radius_slopes[i] + c * limb.radii[i + 1] +
                              d * limb.radius_slopes[i + 1];
        const Vec3 away = x - centre;
        const double length = away.norm();
        value = {length - radius, length > 1e-12 ? Vec3(away / length) : Vec3::UnitX(), radius};
        if (iteration == 2) return value;
        const double a1 = 6 * t2 - 6 * t, b1 = 3 * t2 - 4 * t + 1, d1 = 3 * t2 - 2 * t;
        const Vec3 slope =
            a1 * (limb.points[i] - limb.points[i + 1]) + b1 * limb.tangents[i] + d1 * limb.tangents[i + 1];
        const double widening = a1 * (limb.radii[i] - limb.radii[i + 1]) + b1 * limb.radius_slopes[i] +
                                d1 * limb.radius_slopes[i + 1];
        const double a2 = 12 * t - 6, b2 = 6 * t - 4, d2 = 6 * t - 2;
        const Vec3 bend =
            a2 * (limb.points[i] - limb.points[i + 1]) + b2 * limb.tangents[i] + d2 * limb.tangents[i + 1];
        const double along = value.gradient.dot(slope);
        const double first = -along - widening;
        const double second =
            (slope.squaredNorm() - along * along) / std::max(length, 1e-6) - value.gradient.dot(bend);
        if (second <= 0) return value;
        const double next = std::clamp(at - first / second, low, high);
        if (std::abs(next - at) < 1e-9) return value;
        at = next;
    }
}

ImplicitLumen::Value ImplicitLumen::evaluate(const Vec3& x, std::span<const Run> runs) const {
    Value united;
    bool any = false;
    for (std::size_t k = 0; k < runs.size();) {
        const int b = runs[k].limb;
        const Limb& limb = limbs_[b];
        int nearest = -1;
        double least = std::numeric_limits<double>::infinity();
        for (; k < runs.size() && runs[k].limb == b; ++k) {
            for (int i = runs[k].first; i <= runs[k].last; ++i) {
                const double distance = ball_distance(limb, i, x);
                if (distance < least) least = distance, nearest = i;
            }
        }
        Value value = limb_value(limb, nearest, x);
        if (!any) {
            united = value, any = true;
            continue;
        }
        const Vec3 from = x - limb.junction;
        const double far = from.norm(), span = (no_blend - full_blend) * limb.reach;
        const double t = std::clamp((no_blend * limb.reach - far) / span, 0.0, 1.0);
        const double width = limb.blend * t * t * (3 - 2 * t);
        const double apart = value.distance - united.distance;
        const Value& lesser = apart < 0 ? value : united;
        if (std::abs(apart) >= width) {
            united = Value(lesser);
            continue;
        }
        // Cubic smooth minimum: min − w h³/6 with h = (w − |apart|)/w.
        const double h = (width - std::abs(apart)) / width, half = 0.5 * h * h;
        const Value& greater = apart < 0 ? united : value;
        Value smooth;
        smooth.distance = lesser.distance - width * h * h * h / 6;
        smooth.gradient = (1 - half) * lesser.gradient + half * greater.gradient;
        if (t > 0 && t < 1) {
            const double widening = limb.blend * 6 * t * (1 - t) * (-1 / span);
            smooth.gradient -= (half - h * h * h / 3) * widening * (from / far);
        }
        // The blend is a saddle about as narrow as the child.
        smooth.radius = std::min(lesser.radius, greater.radius);
        united = smooth;
    }
    return united;
}

ImplicitLumen::Value ImplicitLumen::at(const Vec3& x) const {
    const double edge = block_cells * cell_;
    const Vec3 p = x / edge - offset;
    const int block = find({static_cast<int>(std::floor(p.x())), static_cast<int>(std::floor(p.y())),
                            static_cast<int>(std::floor(p.z()))});
    if (block < 0) return evaluate(x, all_);
    const auto first = static_cast<std::size_t>(first_run_[block]);
    return evaluate(x, std::span(runs_).subspan(first, first_run_[block + 1] - first));
}

Vec3 ImplicitLumen::projected(const Vec3& from) const {
    Vec3 x = from;
    for (int iteration = 0; iteration < 12; ++iteration) {
        const Value value = at(x);
        const double slope = value.gradient.squaredNorm();
        if (std::abs(value.distance) < 1e-7 || slope < 1e-6) break;
        const Vec3 step = -value.distance / slope * value.gradient;
        x += step * std::min(1.0, cell_ / step.norm());
    }
    return x;
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

/// Of each limb the samples that, anywhere within `reach` of the centre, may hold the nearest ball or one
/// that the smooth minimum still feels.
void ImplicitLumen::collect_runs(const Vec3& centre, double reach, std::vector<Run>& runs) const {
    std::vector<std::vector<double>> distances(limbs_.size());
    std::vector<double> least(limbs_.size(), std::numeric_limits<double>::infinity());
    double least_of_all = std::numeric_limits<double>::infinity();
    for (std::size_t b = 0; b < limbs_.size(); ++b) {
        const Limb& limb = limbs_[b];
        distances[b].resize(limb.points.size());
        for (int i = 0; i < static_cast<int>(limb.points.size()); ++i) {
            distances[b][i] = ball_distance(limb, i, centre);
            least[b] = std::min(least[b], distances[b][i]);
        }
        least_of_all = std::min(least_of_all, least[b]);
    }
    for (int b = 0; b < static_cast<int>(limbs_.size()); ++b) {
        double blend = limbs_[b].blend;
        for (const Limb& other : limbs_) blend = std::max(blend, other.blend);
        if (least[b] > least_of_all + 2 * reach + blend) continue;
        const double most = least[b] + 2 * reach;
        for (int i = 0; i < static_cast<int>(distances[b].size()); ++i) {
            if (distances[b][i] > most) continue;
            if (!runs.empty() && runs.back().limb == b && runs.back().last == i - 1)
                runs.back().last = i;
            else
                runs.push_back({b, i, i});
        }
    }
}

void ImplicitLumen::make_blocks() {
    const double edge = block_cells * cell_;
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
                        if (distance < edge + 2 * cell_ + limb.blend) of_limb.push_back(block);
                    }
            if (of_limb.size() < most_blocks && i + 1 < limb.points.size()) continue;
            std::sort(of_limb.begin(), of_limb.end());
            of_limb.erase(std::unique(of_limb.begin(), of_limb.end()), of_limb.end());
            if (of_limb.size() > most_blocks) {
                throw InputError("the vessels are too large for their smallest radius; a grid of up to " +
                                 std::to_string(most_blocks) + " blocks is accepted");
            }
        }
        near.insert(near.end(), of_limb.begin(), of_limb.end());
    }
    const auto by_z = [](const Block& a, const Block& b) {
        return std::array{a[2], a[1], a[0]} < std::array{b[2], b[1], b[0]};
    };
    std::sort(near.begin(), near.end(), by_z);
    near.erase(std::unique(near.begin(), near.end()), near.end());

    // A node of a cell with both signs is within the cell's diagonal of the surface; one more for nodes that
    // surface nets fill.
    const double half_diagonal = 0.5 * std::sqrt(3.0) * edge, diagonal = 2 * std::sqrt(3.0) * cell_;
    std::vector<Run> runs;
    for (const Block& block : near) {
        const Vec3 centre = node(block, block_cells / 2, block_cells / 2, block_cells / 2);
        runs.clear();
        collect_runs(centre, half_diagonal + cell_, runs);
        if (std::abs(evaluate(centre, runs).distance) > 1.1 * (half_diagonal + diagonal)) continue;
        index_.emplace(key(block), static_cast<int>(blocks_.size()));
        blocks_.push_back(block);
        first_run_.push_back(static_cast<int>(runs_.size()));
        runs_.insert(runs_.end(), runs.begin(), runs.end());
    }
    first_run_.push_back(static_cast<int>(runs_.size()));
}

}  // namespace engine

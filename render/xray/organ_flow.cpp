#include "render/xray/organ_flow.h"

#include <algorithm>
#include <cmath>

namespace render {

using geometry::Vec3;

void OrganFlow::Samples::add(const TissueLayer& layer) {
    const std::array moved = {&layer.breath, &layer.beat, &layer.drift};
    std::vector<Vec3> normals(layer.mesh.vertices.size(), Vec3::Zero());
    double area = 0, volume = 0;
    for (const auto& t : layer.mesh.triangles) {
        const Vec3 &a = layer.mesh.vertices[t[0]], &b = layer.mesh.vertices[t[1]],
                   &c = layer.mesh.vertices[t[2]];
        const Vec3 across = (b - a).cross(c - a);
        for (const int corner : t) normals[corner] += across;
        area += 0.5 * across.norm();
        volume += a.dot(b.cross(c)) / 6;
    }
    if (!(area > 0)) return;
    // An outline is as deep as its body is thick; fine vessels must not outvote the heart.
    const double thickness = std::abs(volume) / area;
    constexpr std::size_t most = 30'000;  // of a layer
    const std::size_t stride = layer.mesh.vertices.size() / most + 1;
    for (std::size_t i = 0; i < layer.mesh.vertices.size(); i += stride) {
        const double size = normals[i].norm();
        if (!(size > 0)) continue;
        Sample sample{layer.mesh.vertices[i].cast<float>(),
                      (normals[i] / size).cast<float>(),
                      {},
                      static_cast<float>(size * thickness)};
        for (int m = 0; m < movers; ++m)
            sample.moves[m] = moved[m]->empty() ? Eigen::Vector3f(0, 0, 0) : (*moved[m])[i];
        samples_.push_back(sample);
    }
}

namespace {

/// Weighted sums at the nodes of a grid of `side` nodes.
struct Sums {
    int side;
    std::vector<float> weights;
    std::vector<std::array<Eigen::Vector2f, movers>> flows;

    explicit Sums(int nodes)
        : side(nodes), weights(static_cast<std::size_t>(nodes) * nodes, 0.0f), flows(weights.size()) {
        for (auto& flow : flows) flow.fill(Eigen::Vector2f::Zero());
    }
    std::size_t at(int i, int j) const { return static_cast<std::size_t>(j) * side + i; }
};

/// Means at the nodes, each drawn a little toward the mean of its wider surroundings, which alone counts
/// where nothing is.
std::vector<std::array<Eigen::Vector2f, movers>> smooth_means(const Sums& sums) {
    constexpr float pull = 0.05f;
    std::vector<std::array<Eigen::Vector2f, movers>> means(sums.flows.size());
    const bool widest = sums.side <= 2;
    Sums wide(widest ? 1 : sums.side / 2 + 1);
    if (!widest) {
        for (int j = 0; j < sums.side; ++j)
            for (int i = 0; i < sums.side; ++i) {
                const std::size_t from = sums.at(i, j);
                // A node halfway between two wide ones counts for both.
                for (const int v : {j / 2, (j + 1) / 2})
                    for (const int u : {i / 2, (i + 1) / 2}) {
                        const std::size_t to = wide.at(u, v);
                        wide.weights[to] += 0.25f * sums.weights[from];
                        for (int m = 0; m < movers; ++m) wide.flows[to][m] += 0.25f * sums.flows[from][m];
                    }
            }
    }
    const auto around = widest ? std::vector<std::array<Eigen::Vector2f, movers>>() : smooth_means(wide);
    Eigen::Vector2f whole[movers];
    float all = 0;
    for (int m = 0; m < movers; ++m) whole[m].setZero();
    for (std::size_t n = 0; n < sums.flows.size(); ++n) {
        all += sums.weights[n];
        for (int m = 0; m < movers; ++m) whole[m] += sums.flows[n][m];
    }
    for (int j = 0; j < sums.side; ++j)
        for (int i = 0; i < sums.side; ++i) {
            const std::size_t n = sums.at(i, j);
            for (int m = 0; m < movers; ++m) {
                if (widest) {
                    means[n][m] =
                        all > 0 ? Eigen::Vector2f(whole[m] / all) : Eigen::Vector2f(Eigen::Vector2f::Zero());
                    continue;
                }
                Eigen::Vector2f wider = Eigen::Vector2f::Zero();
                float weight = 0;
                for (const int v : {j / 2, (j + 1) / 2})
                    for (const int u : {i / 2, (i + 1) / 2}) {
                        wider += 0.25f * around[wide.at(u, v)][m];
                        weight += 0.25f * wide.weights[wide.at(u, v)];
                    }
                const float pulls = 0.25f * pull * weight, sum = sums.weights[n] + pulls;
                means[n][m] = sum > 0 ? Eigen::Vector2f((sums.flows[n][m] + pulls * wider) / sum) : wider;
            }
        }
    return means;
}

}  // namespace

OrganFlow::OrganFlow(const Samples& samples, const CArm& arm)
    : cell_(static_cast<float>(arm.pixels) / (side - 1 - 2 * margin)) {
    Sums sums(side);
    const Vec3 from = source(arm);
    const Eigen::Matrix<double, 3, 4> camera = camera_matrix(arm);
    const auto seen = [&camera](const Vec3& p) -> Vec3 { return camera * p.homogeneous(); };
    for (const Samples::Sample& sample : samples.samples_) {
        const Vec3 place = sample.place.cast<double>(), image = seen(place);
        if (!(image.z() > 1.0)) continue;
        const double u = image.x() / image.z() / cell_ + margin, v = image.y() / image.z() / cell_ + margin;
        if (!(u >= 0 && v >= 0 && u < side - 1 && v < side - 1)) continue;
        const double facing = sample.normal.cast<double>().dot((place - from).normalized());
        const double edge_on = std::pow(1.0 - facing * facing, 4.0);
        const auto weight = static_cast<float>(sample.weight * (edge_on + 1e-3));
        Flows flows;
        for (int m = 0; m < movers; ++m) {
            const Vec3 moved = seen(place + sample.moves[m].cast<double>());
            flows[m] = (moved.head<2>() / moved.z() - image.head<2>() / image.z()).cast<float>();
        }
        const int i = static_cast<int>(u), j = static_cast<int>(v);
        for (int corner = 0; corner < 4; ++corner) {
            const int a = corner & 1, b = corner >> 1;
            const auto share =
                weight * static_cast<float>((a ? u - i : 1 - (u - i)) * (b ? v - j : 1 - (v - j)));
            const std::size_t n = sums.at(i + a, j + b);
            sums.weights[n] += share;
            for (int m = 0; m < movers; ++m) sums.flows[n][m] += share * flows[m];
        }
    }
    nodes_ = smooth_means(sums);
}

OrganFlow::Flows OrganFlow::at(float x, float y) const {
    const float u = std::clamp(x / cell_ + margin, 0.0f, side - 1.001f),
                v = std::clamp(y / cell_ + margin, 0.0f, side - 1.001f);
    const int i = static_cast<int>(u), j = static_cast<int>(v);
    const float fu = u - static_cast<float>(i), fv = v - static_cast<float>(j);
    const Flows* const row = nodes_.data() + static_cast<std::size_t>(j) * side + i;
    Flows flows;
    for (int m = 0; m < movers; ++m)
        flows[m] = (1 - fv) * ((1 - fu) * row[0][m] + fu * row[1][m]) +
                   fv * ((1 - fu) * row[side][m] + fu * row[side + 1][m]);
    return flows;
}

std::vector<OrganFlow::Flows> OrganFlow::at_shares(const MoverShares& now, const Box& box) const {
    std::vector<Flows> found(nodes_.size());
    for (Flows& flows : found) flows.fill(Eigen::Vector2f::Zero());
    const auto before = [this](int pixel) {
        return std::clamp(static_cast<int>(std::floor(static_cast<float>(pixel) / cell_)) + margin, 0,
                          side - 1);
    };
    const auto after = [&](int pixel) { return std::min(before(pixel) + 1, side - 1); };
    for (int j = before(box.top); j <= after(box.bottom); ++j)
        for (int i = before(box.left); i <= after(box.right); ++i) {
            const std::size_t n = static_cast<std::size_t>(j) * side + i;
            const Eigen::Vector2f seen(static_cast<float>(i - margin) * cell_,
                                       static_cast<float>(j - margin) * cell_);
            Flows& flows = found[n];
            flows = nodes_[n];
            // Those of its place at rest, which they lead back to.
            for (int round = 0; round < 2; ++round) {
                Eigen::Vector2f rest = seen;
                for (int m = 0; m < movers; ++m) rest -= static_cast<float>(now[m]) * flows[m];
                flows = at(rest.x(), rest.y());
            }
        }
    return found;
}

double OrganFlow::farthest(const MoverShares& steps) const {
    float most = 0;
    for (const Flows& flows : nodes_) {
        float sum = 0;
        for (int m = 0; m < movers; ++m) sum += static_cast<float>(steps[m]) * flows[m].cwiseAbs().maxCoeff();
        most = std::max(most, sum);
    }
    return most;
}

}  // namespace render

#include "render/xray/organ_phases.h"

#include <algorithm>
#include <cmath>

#include "render/picture/fast_math.h"

namespace render {

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
            const auto fraction =
                weight * static_cast<float>((a ? u - i : 1 - (u - i)) * (b ? v - j : 1 - (v - j)));
            const std::size_t n = sums.at(i + a, j + b);
            sums.weights[n] += fraction;
            for (int m = 0; m < movers; ++m) sums.flows[n][m] += fraction * flows[m];
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

std::vector<OrganFlow::Flows> OrganFlow::at_fractions(const MoverFractions& now, const Box& box) const {
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

double OrganFlow::farthest(const MoverFractions& steps) const {
    float most = 0;
    for (const Flows& flows : nodes_) {
        float sum = 0;
        for (int m = 0; m < movers; ++m) sum += static_cast<float>(steps[m]) * flows[m].cwiseAbs().maxCoeff();
        most = std::max(most, sum);
    }
    return most;
}

namespace {

/// The smallest window of the image that holds everything that is not 0, with two pixels more around it. The
/// image begins `margin` pixels before the window's coordinates do.
template <class IsSome>
WindowImage<char> window_around(int pixels, int margin, const IsSome& is_some) {
    int left = pixels, right = 0, top = pixels, bottom = 0;
    for (int j = 0; j < pixels; ++j) {
        const std::size_t row = static_cast<std::size_t>(j) * pixels;
        int first = 0, end = pixels;
        while (first < end && !is_some(row + first)) ++first;
        if (first == end) continue;
        while (!is_some(row + end - 1)) --end;
        left = std::min(left, first), right = std::max(right, end);
        top = std::min(top, j), bottom = j + 1;
    }
    if (left >= right) return {};
    left = std::max(left - 2, 0), top = std::max(top - 2, 0);
    right = std::min(right + 2, pixels), bottom = std::min(bottom + 2, pixels);
    return {left - margin, top - margin, right - left, bottom - top, {}};
}

template <class Value>
WindowImage<Value> as_window(const WindowImage<char>& window) {
    WindowImage<Value> made{window.left, window.top, window.width, window.height, {}};
    made.values.resize(static_cast<std::size_t>(window.width) * window.height, Value{});
    return made;
}

WindowImage<float> cut(const Field& image, int margin) {
    const WindowImage<char> window =
        window_around(image.width, margin, [&](std::size_t i) { return image.values[i] != 0.0f; });
    WindowImage<float> made = as_window<float>(window);
    for (int j = 0; j < made.height; ++j)
        std::copy_n(image.values.data() + static_cast<std::size_t>(j + made.top + margin) * image.width +
                        made.left + margin,
                    made.width, made.values.data() + static_cast<std::size_t>(j) * made.width);
    return made;
}

}  // namespace

/// Gives `add` each pixel of a part of a row within reach of the image, and the image's value where that
/// pixel's organs are in the phase.
template <class Value, class Add>
void OrganMoment::for_each(const Group& group, const WindowImage<Value>& image, int row, int first, int end,
                           const Add& add) {
    if (image.values.empty() || row < image.top - group.reach ||
        row >= image.top + image.height + group.reach)
        return;
    first = std::max(first, image.left - group.reach);
    end = std::min(end, image.left + image.width + group.reach);
    constexpr int side = OrganFlow::side;
    const float per_cell = 1 / group.cell, v = static_cast<float>(row) * per_cell + OrganFlow::margin;
    const int j = std::clamp(static_cast<int>(v), 0, side - 2);
    const float fv = v - static_cast<float>(j);
    const Eigen::Vector2f* const nodes = group.displacement.data() + static_cast<std::size_t>(j) * side;
    const auto node = [&](int i) -> Eigen::Vector2f { return (1 - fv) * nodes[i] + fv * nodes[side + i]; };
    // A hair before the last row and column, so that there is one after each.
    const float right = static_cast<float>(image.width - 1) - 1e-3f,
                low = static_cast<float>(image.height - 1) - 1e-3f;
    for (int x = first; x < end;) {
        const int i =
            std::clamp(static_cast<int>(static_cast<float>(x) * per_cell) + OrganFlow::margin, 0, side - 2);
        const float start = static_cast<float>(i - OrganFlow::margin) * group.cell;
        const int stop = std::min(end, std::max(x + 1, static_cast<int>(std::ceil(start + group.cell))));
        const Eigen::Vector2f from = node(i), change = (node(i + 1) - from) * per_cell;
        // Place in the image of pixel x: (a + x·da, b + x·db).
        const float a = from.x() - start * change.x() - static_cast<float>(image.left), da = 1 + change.x(),
                    b = from.y() - start * change.y() + static_cast<float>(row - image.top), db = change.y();
        // In two passes: compilers make the first four pixels at a time.
        constexpr int together = 32;
        std::array<std::int32_t, together> columns, rows;
        std::array<float, together> across, down;
        for (; x < stop; x += together) {
            const int count = std::min(together, stop - x);
            // The rim holds nothing, but where the image's own edge is.
            for (int k = 0; k < count; ++k) {
                const auto pixel = static_cast<float>(x + k);
                const float u = std::min(std::max(a + pixel * da, 0.0f), right),
                            w = std::min(std::max(b + pixel * db, 0.0f), low);
                columns[k] = static_cast<std::int32_t>(u);
                rows[k] = static_cast<std::int32_t>(w);
                across[k] = u - static_cast<float>(columns[k]);
                down[k] = w - static_cast<float>(rows[k]);
            }
            for (int k = 0; k < count; ++k) {
                const Value* const at =
                    image.values.data() + static_cast<std::ptrdiff_t>(rows[k]) * image.width + columns[k];
                const Value upper = at[0] + across[k] * (at[1] - at[0]),
                            lower = at[image.width] + across[k] * (at[image.width + 1] - at[image.width]);
                add(x + k, upper + down[k] * (lower - upper));
            }
        }
        x = stop;
    }
}

std::pair<int, int> OrganMoment::dim_row(int row, std::span<FourBins> transmission) const {
    const auto width = static_cast<int>(transmission.size());
    int first = width, end = 0;
    FourBins* const left = transmission.data();
    for (const Group& group : groups_) {
        const WindowImage<FourBins>& image = *group.transmission;
        if (image.values.empty() || row < image.top - group.reach ||
            row >= image.top + image.height + group.reach)
            continue;
        first = std::clamp(image.left - group.reach, 0, first);
        end = std::max(end, std::min(image.left + image.width + group.reach, width));
        for_each(group, image, row, 0, width, [left](int x, const FourBins& own) { left[x] *= own; });
    }
    return {first, std::max(first, end)};
}

void OrganMoment::dim(std::span<const std::uint32_t> pixels, int width, std::span<float> transmission) const {
    for (const Group& group : groups_)
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            const int x = static_cast<int>(pixels[i] % static_cast<std::uint32_t>(width)),
                      row = static_cast<int>(pixels[i] / static_cast<std::uint32_t>(width));
            for_each(group, *group.transmission, row, x, x + 1, [&](int, const FourBins& own) {
                for (int k = 0; k < energy_bins; ++k) transmission[i * energy_bins + k] *= own[k];
            });
        }
}

bool OrganMoment::dissolve_in(int layer, float concentration, Field& iodine,
                              std::vector<std::uint32_t>& pixels) const {
    for (const Group& group : groups_) {
        const auto organ = group.organs.find(layer);
        if (organ == group.organs.end()) continue;
        for (int row = 0; row < iodine.height; ++row)
            for_each(group, *organ->second, row, 0, iodine.width, [&](int x, float length) {
                if (!(length > 0.0f)) return;
                const auto pixel = static_cast<std::uint32_t>(row * iodine.width + x);
                float& there = iodine.values[pixel];
                if (there == 0.0f) pixels.push_back(pixel);
                there += concentration * length;
            });
        return true;
    }
    return false;
}

OrganPhases::OrganPhases(std::span<const TissueLayer> layers) {
    // What the bowel carries goes its own ways, so that it has a flow of its own.
    std::array<Group, 2> groups;
    std::array<OrganFlow::Samples, 2> samples;
    for (std::size_t layer = 0; layer < layers.size(); ++layer) {
        const TissueLayer& tissue = layers[layer];
        if (tissue.material == tissue.inside && !tissue.perfused) continue;
        const std::array<bool, movers> moved = {!tissue.breath.empty(), !tissue.beat.empty(),
                                                !tissue.drift.empty()};
        if (moved == std::array<bool, movers>{}) continue;
        Group& group = groups[moved[Drift]];
        for (int m = 0; m < movers; ++m) group.moved[m] = group.moved[m] || moved[m];
        auto kind = std::find_if(group.kinds.begin(), group.kinds.end(),
                                 [&](const Kind& known) { return known.moved == moved; });
        if (kind == group.kinds.end()) kind = group.kinds.insert(kind, Kind{moved, {}});
        kind->layers.push_back(static_cast<int>(layer));
        samples[moved[Drift]].add(tissue);
    }
    for (std::size_t k = 0; k < groups.size(); ++k) {
        if (groups[k].kinds.empty()) continue;
        groups[k].samples = std::make_shared<const OrganFlow::Samples>(std::move(samples[k]));
        groups_.push_back(std::move(groups[k]));
    }
}

void OrganPhases::beam_changes() {
    still_.clear();
    for (Group& group : groups_) group.images.clear();
}

void OrganPhases::clear() {
    beam_changes();
    for (Group& group : groups_) {
        group.flow.reset();
        for (Kind& kind : group.kinds) kind.drawings.clear();
    }
}

MoverFractions OrganPhases::fractions_of(const Place& place) {
    MoverFractions fractions;
    for (int m = 0; m < movers; ++m) fractions[m] = static_cast<double>(place[m]) / steps[m];
    return fractions;
}

OrganPhases::Place OrganPhases::nearest(const Group& group, const MoverFractions& fractions) {
    Place place{};
    for (int m = 0; m < movers; ++m)
        if (group.moved[m]) place[m] = static_cast<int>(std::lround(fractions[m] * steps[m]));
    return place;
}

void OrganPhases::prepare(Group& group, const PosedLayers& from) {
    if (group.flow) return;
    const CArm& arm = from.pose.arm;
    group.flow.emplace(*group.samples, arm);
    MoverFractions half{};
    for (int m = 0; m < movers; ++m) half[m] = 0.5 / steps[m];
    // What comes into the image from beyond its edges is drawn, too.
    group.margin =
        std::min(static_cast<int>(std::ceil(group.flow->farthest(half))) + 2, std::max(arm.pixels / 8, 2));
    group.arm = arm;
    group.arm.pixels += 2 * group.margin;
    group.arm.detector_width *= static_cast<double>(group.arm.pixels) / arm.pixels;
}

OrganPhases::Place OrganPhases::of_kind(const Kind& kind, Place place) {
    for (int m = 0; m < movers; ++m)
        if (!kind.moved[m]) place[m] = 0;
    return place;
}

/// Draws the next layer; false when there was none left.
bool OrganPhases::draw_layer(Group& group, Kind& kind, const Place& place, const PosedLayers& from) {
    Drawing& drawing = kind.drawings[place];
    if (drawing.next == kind.layers.size()) return false;
    const int layer = kind.layers[drawing.next++];
    const TissueLayer& tissue = from.layers[static_cast<std::size_t>(layer)];
    const CArm& arm = group.arm;
    const MoverFractions fractions = fractions_of(place);
    const PathLengthRenderer::Phase at{fractions[Breath], fractions[Beat], fractions[Drift]};
    drawing.sums.resize(from.pose.mixtures.size());
    Field* sum = nullptr;
    if (tissue.material != tissue.inside) {
        for (std::size_t m = 0; m < from.pose.mixtures.size(); ++m) {
            const Mixture& mixture = from.pose.mixtures[m];
            if (mixture.material == tissue.material && mixture.inside == tissue.inside)
                sum = &drawing.sums[m];
        }
        if (sum && sum->values.empty()) *sum = Field(arm.pixels, arm.pixels);
    }
    if (!tissue.perfused) {
        if (sum) from.renderer.accumulate(layer, arm, *sum, at);
        return true;
    }
    Field own = from.renderer.render(layer, arm, at).length;
    if (sum)
        for (std::size_t i = 0; i < own.values.size(); ++i) sum->values[i] += own.values[i];
    drawing.organs[layer] = cut(own, group.margin);
    return true;
}

const WindowImage<FourBins>& OrganPhases::image(Group& group, const Place& place, const Exposure& exposure,
                                                const BeamImages& beam, const PosedLayers& from) {
    const std::pair key{exposure.kvp.value_or(0.0), place};
    const auto known = group.images.find(key);
    if (known != group.images.end()) return known->second;
    std::vector<std::pair<const Field*, FourBins>> lengths;  // and what a length adds to the exponents [1/mm]
    for (Kind& kind : group.kinds) {
        const Place own = of_kind(kind, place);
        while (draw_layer(group, kind, own, from)) {
        }
        const Drawing& drawing = kind.drawings[own];
        for (std::size_t m = 0; m < drawing.sums.size(); ++m) {
            if (drawing.sums[m].values.empty()) continue;
            const PixelBins change = change_of(from.pose.mixtures[m], beam.bins);
            lengths.emplace_back(&drawing.sums[m], FourBins{-change[0], -change[1], -change[2], -change[3]});
        }
    }
    const int pixels = group.arm.pixels;
    WindowImage<FourBins> made = as_window<FourBins>(window_around(pixels, group.margin, [&](std::size_t i) {
        return std::any_of(lengths.begin(), lengths.end(),
                           [i](const auto& length) { return length.first->values[i] != 0.0f; });
    }));
    for (const auto& [length, per_mm] : lengths)
        for (int j = 0; j < made.height; ++j) {
            const float* const mm = length->values.data() +
                                    static_cast<std::size_t>(j + made.top + group.margin) * pixels +
                                    made.left + group.margin;
            FourBins* const to = made.values.data() + static_cast<std::size_t>(j) * made.width;
            for (int i = 0; i < made.width; ++i) to[i] += mm[i] * per_mm;
        }
    // Lengths that no other phase of the group needs. Another voltage has them drawn again.
    for (Kind& kind : group.kinds)
        if (kind.moved == group.moved) {
            Drawing& drawing = kind.drawings[place];
            drawing.sums.clear();
            drawing.next = 0;
        }
    exponentiate({reinterpret_cast<float*>(made.values.data()), made.values.size() * energy_bins});
    return group.images.emplace(key, std::move(made)).first->second;
}

/// What is left of the beam without the organs that move.
const std::vector<PixelBins>& OrganPhases::still(const Exposure& exposure, const BeamImages& beam,
                                                 const PosedLayers& from) {
    const auto [place, is_new] = still_.try_emplace(exposure.kvp.value_or(0.0));
    std::vector<PixelBins>& left = place->second;
    if (!is_new) return left;
    left = beam.primary;
    const int pixels = from.pose.arm.pixels;
    for (Group& group : groups_) {
        const WindowImage<FourBins>& rest = image(group, {}, exposure, beam, from);
        for (int row = std::max(rest.top, 0); row < std::min(rest.top + rest.height, pixels); ++row)
            for (int x = std::max(rest.left, 0); x < std::min(rest.left + rest.width, pixels); ++x) {
                const FourBins& own =
                    rest.values[static_cast<std::size_t>(row - rest.top) * rest.width + (x - rest.left)];
                PixelBins& bins = left[static_cast<std::size_t>(row) * pixels + x];
                for (int k = 0; k < energy_bins; ++k) bins[k] = own[k] > 0.0f ? bins[k] / own[k] : 0.0f;
            }
    }
    return left;
}

OrganMoment OrganPhases::moment(const Exposure& exposure, const BeamImages& beam, const PosedLayers& from) {
    OrganMoment moment;
    const MoverFractions fractions = {exposure.breath, exposure.beat, exposure.drift};
    const auto moves = [&fractions](const Group& group) {
        for (int m = 0; m < movers; ++m)
            if (group.moved[m] && fractions[m] > 0.0) return true;
        return false;
    };
    if (std::none_of(groups_.begin(), groups_.end(), moves)) return moment;
    const int pixels = from.pose.arm.pixels;
    for (Group& group : groups_) {
        prepare(group, from);
        const Place place = nearest(group, fractions);
        OrganMoment::Group& made = moment.groups_.emplace_back();
        made.transmission = &image(group, place, exposure, beam, from);
        for (Kind& kind : group.kinds)
            for (const auto& [layer, organ] : kind.drawings[of_kind(kind, place)].organs)
                made.organs[layer] = &organ;
        made.cell = group.flow->cell();
        made.reach = group.margin;
        const WindowImage<FourBins>& shown = *made.transmission;
        const std::vector<OrganFlow::Flows> flows = group.flow->at_fractions(
            fractions, {std::max(shown.left - made.reach, 0), std::max(shown.top - made.reach, 0),
                        std::min(shown.left + shown.width + made.reach, pixels),
                        std::min(shown.top + shown.height + made.reach, pixels)});
        const MoverFractions to = fractions_of(place);
        for (const OrganFlow::Flows& flow : flows) {
            Eigen::Vector2f& displacement = made.displacement.emplace_back(Eigen::Vector2f::Zero());
            for (int m = 0; m < movers; ++m)
                if (group.moved[m]) displacement += static_cast<float>(to[m] - fractions[m]) * flow[m];
        }
    }
    moment.still_ = &still(exposure, beam, from);
    return moment;
}

bool OrganPhases::draw_ahead(const Exposure& exposure, const BeamImages& beam, const PosedLayers& from) {
    const double kvp = exposure.kvp.value_or(0.0);
    for (Group& group : groups_) {
        prepare(group, from);
        std::vector<Place> order;
        Place place{};
        for (place[Drift] = 0; place[Drift] <= (group.moved[Drift] ? steps[Drift] : 0); ++place[Drift])
            for (place[Breath] = 0; place[Breath] <= (group.moved[Breath] ? steps[Breath] : 0);
                 ++place[Breath])
                for (place[Beat] = 0; place[Beat] <= (group.moved[Beat] ? steps[Beat] : 0); ++place[Beat])
                    order.push_back(place);
        // A beat passes through its phases sooner than a breath, which goes on from where it is, and a breath
        // sooner than the bowel.
        const auto later = [&](const Place& p) {
            return std::pair{std::abs(p[Drift] - exposure.drift * steps[Drift]),
                             std::abs(p[Breath] - exposure.breath * steps[Breath])};
        };
        std::stable_sort(order.begin(), order.end(),
                         [&](const Place& a, const Place& b) { return later(a) < later(b); });
        for (const Place& next : order) {
            if (group.images.contains({kvp, next})) continue;
            for (Kind& kind : group.kinds)
                if (draw_layer(group, kind, of_kind(kind, next), from)) return true;
            image(group, next, exposure, beam, from);
            return true;
        }
    }
    return false;
}

}  // namespace render

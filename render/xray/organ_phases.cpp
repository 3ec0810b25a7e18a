#include "render/xray/organ_phases.h"

#include <algorithm>
#include <cmath>

namespace render {
namespace {

constexpr FourBins no_bins = {};

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

/// Gives `add` each pixel of a part of a row and the part's value where that pixel's organs are in the phase.
template <class Value, class Of, class Add>
void OrganMoment::for_each(const Group& group, const Part& part, int row, int first, int end, const Of& of,
                           const Add& add) {
    const WindowImage<Value>& image = of(part);
    if (image.values.empty()) return;
    constexpr int side = OrganFlow::side;
    const float v = static_cast<float>(row) / group.cell + OrganFlow::margin;
    const int j = std::clamp(static_cast<int>(v), 0, side - 2);
    const float fv = v - static_cast<float>(j);
    const Eigen::Vector2f* const nodes = part.way.data() + static_cast<std::size_t>(j) * side;
    const auto node = [&](int i) -> Eigen::Vector2f { return (1 - fv) * nodes[i] + fv * nodes[side + i]; };
    const float per_cell = 1 / group.cell;
    const auto right_edge = static_cast<float>(image.width - 1),
               low_edge = static_cast<float>(image.height - 1);
    for (int x = first; x < end;) {
        const int i =
            std::clamp(static_cast<int>(static_cast<float>(x) * per_cell) + OrganFlow::margin, 0, side - 2);
        const int stop = std::min(
            end, std::max(x + 1, static_cast<int>(
                                     std::ceil(static_cast<float>(i + 1 - OrganFlow::margin) * group.cell))));
        const Eigen::Vector2f from = node(i), change = (node(i + 1) - from) * per_cell;
        const float start = static_cast<float>(i - OrganFlow::margin) * group.cell;
        for (; x < stop; ++x) {
            const float along = static_cast<float>(x) - start;
            // Beyond the window there is nothing, and its rim holds nothing.
            const float a = std::clamp(static_cast<float>(x - image.left) + (from.x() + along * change.x()),
                                       0.0f, right_edge),
                        b = std::clamp(static_cast<float>(row - image.top) + (from.y() + along * change.y()),
                                       0.0f, low_edge);
            const int p = std::min(static_cast<int>(a), image.width - 2),
                      q = std::min(static_cast<int>(b), image.height - 2);
            const float fa = a - static_cast<float>(p), fb = b - static_cast<float>(q);
            const Value* const at = image.values.data() + static_cast<std::size_t>(q) * image.width + p;
            const float both = fa * fb;
            add(x, (1 - fa - fb + both) * at[0] + (fa - both) * at[1] + (fb - both) * at[image.width] +
                       both * at[image.width + 1]);
        }
    }
}

bool OrganMoment::add_to_row(int row, std::span<float> exponents) const {
    bool moves = false;
    for (const Group& group : groups_) {
        if (row < group.top || row >= group.bottom) continue;
        moves = true;
        auto* const sums = reinterpret_cast<float*>(exponents.data());
        const auto add = [&](int x, const FourBins& own) {
            for (int k = 0; k < energy_bins; ++k) sums[x * energy_bins + k] += own[k];
        };
        for (const Part& part : group.parts)
            for_each<FourBins>(
                group, part, row, group.left, group.right,
                [](const Part& p) -> const WindowImage<FourBins>& { return *p.exponents; },
                [&](int x, const FourBins& own) { add(x, part.weight * own); });
        const WindowImage<FourBins>& rest = *group.rest;
        if (row < rest.top || row >= rest.top + rest.height) continue;
        const FourBins* const at = rest.values.data() + static_cast<std::size_t>(row - rest.top) * rest.width;
        const int first = std::max(rest.left, 0),
                  end = std::min(rest.left + rest.width, static_cast<int>(exponents.size()) / energy_bins);
        for (int x = first; x < end; ++x) add(x, -at[x - rest.left]);
    }
    return moves;
}

void OrganMoment::add_to(std::span<const std::uint32_t> pixels, int width, std::span<float> exponents) const {
    for (const Group& group : groups_) {
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            const int x = static_cast<int>(pixels[i] % static_cast<std::uint32_t>(width)),
                      row = static_cast<int>(pixels[i] / static_cast<std::uint32_t>(width));
            if (row < group.top || row >= group.bottom || x < group.left || x >= group.right) continue;
            float* const sums = exponents.data() + i * energy_bins;
            const auto add = [&](const FourBins& own) {
                for (int k = 0; k < energy_bins; ++k) sums[k] += own[k];
            };
            for (const Part& part : group.parts)
                for_each<FourBins>(
                    group, part, row, x, x + 1,
                    [](const Part& p) -> const WindowImage<FourBins>& { return *p.exponents; },
                    [&](int, const FourBins& own) { add(part.weight * own); });
            const WindowImage<FourBins>& rest = *group.rest;
            const int u = x - rest.left, v = row - rest.top;
            if (u >= 0 && v >= 0 && u < rest.width && v < rest.height)
                add(-rest.values[static_cast<std::size_t>(v) * rest.width + u]);
        }
    }
}

bool OrganMoment::dissolve_in(int layer, float concentration, Field& iodine,
                              std::vector<std::uint32_t>& pixels) const {
    for (const Group& group : groups_) {
        if (group.parts.empty() || !group.parts.front().organs.contains(layer)) continue;
        for (int row = group.top; row < group.bottom; ++row)
            for (const Part& part : group.parts) {
                const WindowImage<float>& organ = *part.organs.at(layer);
                // A row that the organ is far from costs nothing.
                const int reach = group.reach;
                if (row < organ.top - reach || row >= organ.top + organ.height + reach) continue;
                for_each<float>(
                    group, part, row, std::max(group.left, organ.left - reach),
                    std::min(group.right, organ.left + organ.width + reach),
                    [&](const Part&) -> const WindowImage<float>& { return organ; },
                    [&](int x, float length) {
                        if (!(length > 0.0f)) return;
                        const auto pixel =
                            static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(iodine.width) +
                            static_cast<std::uint32_t>(x);
                        float& there = iodine.values[pixel];
                        if (there == 0.0f) pixels.push_back(pixel);
                        there += concentration * part.weight * length;
                    });
            }
        return true;
    }
    return false;
}

OrganPhases::OrganPhases(std::span<const TissueLayer> layers) {
    // What the bowel carries goes its own ways, so that it has a flow of its own.
    std::array<Group, 2> groups;
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
        group.samples.add(tissue);
    }
    for (Group& group : groups)
        if (!group.kinds.empty()) groups_.push_back(std::move(group));
}

void OrganPhases::clear() {
    for (Group& group : groups_) {
        group.flow.reset();
        group.exponents.clear();
        for (Kind& kind : group.kinds) kind.drawings.clear();
    }
}

MoverShares OrganPhases::shares_of(const Place& place) {
    MoverShares shares;
    for (int m = 0; m < movers; ++m) shares[m] = static_cast<double>(place[m]) / steps[m];
    return shares;
}

/// The corners of the simplex of phases (Kuhn's) that the shares lie in: one more than there are movers
/// between phases, so that a blend takes few, and is continuous.
std::vector<OrganPhases::Weighed> OrganPhases::around(const Group& group, const MoverShares& shares) {
    Place place{};
    std::vector<std::pair<double, int>> rest;  // way from `place` in steps, mover
    for (int m = 0; m < movers; ++m) {
        if (!group.moved[m]) continue;
        const double at = std::clamp(shares[m], 0.0, 1.0) * steps[m];
        place[m] = std::min(static_cast<int>(at), steps[m] - 1);
        rest.emplace_back(at - place[m], m);
    }
    std::sort(rest.begin(), rest.end(), [](const auto& a, const auto& b) {
        return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    std::vector<Weighed> corners;
    double before = 1.0;
    for (const auto& [way, mover] : rest) {
        if (before - way > 0.0) corners.push_back({place, before - way});
        before = way;
        ++place[mover];
    }
    if (before > 0.0) corners.push_back({place, before});
    return corners;
}

void OrganPhases::prepare(Group& group, const PosedLayers& from) {
    if (group.flow) return;
    const CArm& arm = from.pose.arm;
    group.flow.emplace(group.samples, arm);
    MoverShares one{};
    for (int m = 0; m < movers; ++m) one[m] = 1.0 / steps[m];
    // What comes into the image from beyond its edges is drawn, too.
    group.margin =
        std::min(static_cast<int>(std::ceil(group.flow->farthest(one))) + 2, std::max(arm.pixels / 8, 2));
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
    const MoverShares shares = shares_of(place);
    const PathLengthRenderer::Phase at{shares[Breath], shares[Beat], shares[Drift]};
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

const WindowImage<FourBins>& OrganPhases::exponents(Group& group, const Place& place,
                                                    const Exposure& exposure, const BeamImages& beam,
                                                    const PosedLayers& from) {
    const std::pair key{exposure.kvp.value_or(0.0), place};
    const auto known = group.exponents.find(key);
    if (known != group.exponents.end()) return known->second;
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
    return group.exponents.emplace(key, std::move(made)).first->second;
}

OrganMoment OrganPhases::moment(const Exposure& exposure, const BeamImages& beam, const PosedLayers& from) {
    OrganMoment moment;
    const MoverShares shares = {exposure.breath, exposure.beat, exposure.drift};
    for (Group& group : groups_) {
        MoverShares now{};
        for (int m = 0; m < movers; ++m) now[m] = group.moved[m] ? std::clamp(shares[m], 0.0, 1.0) : 0.0;
        if (now == MoverShares{}) continue;
        prepare(group, from);
        OrganMoment::Group& made = moment.groups_.emplace_back();
        made.rest = &exponents(group, {}, exposure, beam, from);
        made.cell = group.flow->cell();
        made.reach = group.margin;
        made.left = made.top = from.pose.arm.pixels;
        const auto cover = [&](const WindowImage<FourBins>& image, int reach) {
            if (image.values.empty()) return;
            made.left = std::min(made.left, image.left - reach);
            made.top = std::min(made.top, image.top - reach);
            made.right = std::max(made.right, image.left + image.width + reach);
            made.bottom = std::max(made.bottom, image.top + image.height + reach);
        };
        cover(*made.rest, 0);
        for (const Weighed& corner : around(group, now)) {
            OrganMoment::Part part;
            part.weight = static_cast<float>(corner.weight);
            part.exponents = &exponents(group, corner.place, exposure, beam, from);
            for (Kind& kind : group.kinds)
                for (const auto& [layer, organ] : kind.drawings[of_kind(kind, corner.place)].organs)
                    part.organs[layer] = &organ;
            part.to = shares_of(corner.place);
            cover(*part.exponents, group.margin);
            for (const auto& [layer, organ] : part.organs)
                cover({organ->left, organ->top, organ->width, organ->height, {no_bins}}, group.margin);
            made.parts.push_back(std::move(part));
        }
        made.left = std::max(made.left, 0), made.top = std::max(made.top, 0);
        made.right = std::min(made.right, from.pose.arm.pixels);
        made.bottom = std::min(made.bottom, from.pose.arm.pixels);
        const std::vector<OrganFlow::Flows> flows =
            group.flow->at_shares(now, {made.left, made.top, made.right, made.bottom});
        for (OrganMoment::Part& part : made.parts) {
            part.way.resize(flows.size());
            for (std::size_t n = 0; n < flows.size(); ++n) {
                Eigen::Vector2f way = Eigen::Vector2f::Zero();
                for (int m = 0; m < movers; ++m) way += static_cast<float>(part.to[m] - now[m]) * flows[n][m];
                part.way[n] = way;
            }
        }
    }
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
            if (group.exponents.contains({kvp, next})) continue;
            for (Kind& kind : group.kinds)
                if (draw_layer(group, kind, of_kind(kind, next), from)) return true;
            exponents(group, next, exposure, beam, from);
            return true;
        }
    }
    return false;
}

}  // namespace render

#include "render/xray/organ_phases.h"

#include <algorithm>
#include <cmath>

namespace render {

MovedExponents::MovedExponents(const MovedLengths& there, const PoseImages& pose, const EnergyBins& bins) {
    const std::size_t count = static_cast<std::size_t>(pose.arm.pixels) * pose.arm.pixels,
                      blocks = (count + block - 1) / block;
    starts_.assign(blocks, -1);
    std::vector<std::pair<const Field*, PixelBins>> moving;
    for (std::size_t m = 0; m < there.changes.size(); ++m)
        if (!there.changes[m].values.empty())
            moving.emplace_back(&there.changes[m], change_of(pose.mixtures[m], bins));
    for (std::size_t number = 0; number < blocks; ++number) {
        const std::size_t start = number * block, size = std::min(block, count - start);
        for (const auto& [change, per_mm] : moving) {
            const float* const length = change->values.data() + start;
            if (std::all_of(length, length + size, [](float mm) { return mm == 0.0f; })) continue;
            if (starts_[number] < 0) {
                starts_[number] = static_cast<std::int64_t>(values_.size());
                values_.resize(values_.size() + block * energy_bins, 0.0f);
            }
            float* const exponents = values_.data() + starts_[number];
            for (std::size_t i = 0; i < size; ++i)
                for (int k = 0; k < energy_bins; ++k) exponents[i * energy_bins + k] -= per_mm[k] * length[i];
        }
    }
}

bool OrganMoment::add_to_block(std::size_t number, std::span<float> exponents) const {
    bool moves = false;
    for (const Part& part : parts_) {
        const float* const own = part.there->of_block(number);
        if (!own) continue;
        moves = true;
        for (std::size_t i = 0; i < exponents.size(); ++i) exponents[i] += part.weight * own[i];
    }
    return moves;
}

void OrganMoment::add_to(std::span<const std::uint32_t> pixels, std::span<float> exponents) const {
    constexpr std::size_t block = MovedExponents::block;
    for (const Part& part : parts_) {
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            const float* const own = part.there->of_block(pixels[i] / block);
            if (!own) continue;
            for (int k = 0; k < energy_bins; ++k)
                exponents[i * energy_bins + k] +=
                    part.weight * own[pixels[i] % block * energy_bins + static_cast<std::size_t>(k)];
        }
    }
}

OrganPhases::OrganPhases(std::span<const TissueLayer> layers) {
    for (std::size_t layer = 0; layer < layers.size(); ++layer) {
        const TissueLayer& tissue = layers[layer];
        if (tissue.material == tissue.inside && !tissue.perfused) continue;
        if (!tissue.breath.empty()) layers_[Breath].push_back(static_cast<int>(layer));
        if (!tissue.beat.empty()) layers_[Beat].push_back(static_cast<int>(layer));
        if (!tissue.drift.empty()) layers_[Drift].push_back(static_cast<int>(layer));
    }
}

void OrganPhases::clear() {
    rest_ = {};
    begun_.clear();
    lengths_.clear();
    exponents_.clear();
}

std::vector<OrganPhases::Part> OrganPhases::parts(const Exposure& exposure) const {
    std::vector<Part> parts;
    const std::array<double, movers> shares = {exposure.breath, exposure.beat, exposure.drift};
    for (int mover = 0; mover < movers; ++mover) {
        if (!(shares[mover] > 0.0) || layers_[mover].empty()) continue;
        const int count = counts[mover];
        const double at = std::min(shares[mover], 1.0) * count;
        const int below = std::min(static_cast<int>(at), count - 1), first = first_of(mover);
        const double t = at - below;
        if (below > 0 && t < 1.0) parts.push_back({first + below - 1, 1.0 - t});
        if (t > 0.0) parts.push_back({first + below, t});
    }
    return parts;
}

OrganPhases::Drawing& OrganPhases::rest(Mover mover) {
    if (!rest_[mover]) rest_[mover] = Drawing{};
    return *rest_[mover];
}

/// The first phase of a mover that is not rest.
int OrganPhases::first_of(int mover) {
    int first = 1;
    for (int before = 0; before < mover; ++before) first += counts[before];
    return first;
}

OrganPhases::Mover OrganPhases::mover_of(int phase) {
    return phase >= first_of(Drift) ? Drift : phase >= first_of(Beat) ? Beat : Breath;
}

PathLengthRenderer::Phase OrganPhases::place_of(int phase) {
    const Mover mover = mover_of(phase);
    PathLengthRenderer::Phase at;
    (mover == Breath ? at.breath
     : mover == Beat ? at.beat
                     : at.drift) = static_cast<double>(phase - first_of(mover) + 1) / counts[mover];
    return at;
}

/// Draws the next layer; false when there was none left.
bool OrganPhases::draw_layer(Drawing& drawing, Mover mover, PathLengthRenderer::Phase at,
                             const PosedLayers& from) {
    if (drawing.next == layers_[mover].size()) return false;
    const int layer = layers_[mover][drawing.next++];
    const TissueLayer& tissue = from.layers[static_cast<std::size_t>(layer)];
    const CArm& arm = from.pose.arm;
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
    add_lengths(tissue.lumps, arm, own);
    drawing.organs[layer] = SparseLength(own);
    return true;
}

const MovedLengths& OrganPhases::lengths(int phase, const PosedLayers& from) {
    const auto known = lengths_.find(phase);
    if (known != lengths_.end()) return known->second;
    const Mover mover = mover_of(phase);
    while (draw_layer(rest(mover), mover, {}, from)) {
    }
    Drawing& there = begun_[phase];
    while (draw_layer(there, mover, place_of(phase), from)) {
    }
    // Both sums have their layers in the same order: where nothing moved the difference is 0.
    for (std::size_t m = 0; m < there.sums.size(); ++m) {
        std::vector<float>& lengths = there.sums[m].values;
        const std::vector<float>& before = rest(mover).sums[m].values;
        for (std::size_t i = 0; i < lengths.size(); ++i) lengths[i] -= before[i];
    }
    MovedLengths& made = lengths_[phase];
    made = {std::move(there.sums), std::move(there.organs)};
    begun_.erase(phase);
    return made;
}

const MovedExponents& OrganPhases::exponents(int phase, const Exposure& exposure, const BeamImages& beam,
                                             const PosedLayers& from) {
    const std::pair key{exposure.kvp.value_or(0.0), phase};
    const auto known = exponents_.find(key);
    if (known != exponents_.end()) return known->second;
    return exponents_.emplace(key, MovedExponents(lengths(phase, from), from.pose, beam.bins)).first->second;
}

OrganMoment OrganPhases::moment(const Exposure& exposure, const BeamImages& beam, const PosedLayers& from) {
    OrganMoment moment;
    for (const Part& part : parts(exposure))
        moment.add(static_cast<float>(part.weight), exponents(part.phase, exposure, beam, from));
    return moment;
}

bool OrganPhases::draw_ahead(const Exposure& exposure, const BeamImages& beam, const PosedLayers& from) {
    // A beat passes through its phases sooner than a breath, which goes on from where it is.
    std::vector<int> order;
    const auto add = [&](Mover mover, int phase) {
        if (phase >= 1 && phase <= counts[mover] && !layers_[mover].empty())
            order.push_back(first_of(mover) + phase - 1);
    };
    for (int k = 1; k <= counts[Beat]; ++k) add(Beat, k);
    const int now = static_cast<int>(std::lround(exposure.breath * counts[Breath]));
    for (int away = 0; away <= counts[Breath]; ++away) {
        add(Breath, now + away);
        if (away > 0) add(Breath, now - away);
    }
    for (int k = 1; k <= counts[Drift]; ++k) add(Drift, k);
    for (const int phase : order) {
        if (exponents_.contains({exposure.kvp.value_or(0.0), phase})) continue;
        const Mover mover = mover_of(phase);
        if (!lengths_.contains(phase) && (draw_layer(rest(mover), mover, {}, from) ||
                                          draw_layer(begun_[phase], mover, place_of(phase), from)))
            return true;
        exponents(phase, exposure, beam, from);
        return true;
    }
    return false;
}

}  // namespace render

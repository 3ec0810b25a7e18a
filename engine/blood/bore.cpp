#include "engine/blood/bore.h"

#include <algorithm>
#include <cmath>

namespace blood {
namespace {

/// A plug shorter than this leaves with the rest [-].
constexpr double shortest_plug = 1e-9;
/// Plugs next to each other that differ by less are one, so that a history of many injections stays short
/// [mg/ml].
constexpr double as_good_as_alike = 0.1;

/// Velocity of a ring over the mean: of 2 (1 − s) over its part of s = r²/R².
double ring_speed(int ring) {
    return 2 * (1 - (ring + 0.5) / Bore::rings);
}

}  // namespace

Bore::Bore() : columns_(rings, Column{{Plug{}}}) {}

double Bore::resize(double volume) {
    if (volume == volume_) return 0;
    if (volume < volume_) {
        const double before = iodine();
        volume_ = volume;
        return before - iodine();
    }
    for (Column& column : columns_)
        for (Plug& plug : column.plugs) plug.iodine *= volume_ / volume;
    volume_ = volume;
    return 0;
}

double Bore::push(double volume, double iodine) {
    if (volume_ <= 0) return volume * iodine;
    double out = 0;  // [mg]
    for (int ring = 0; ring < rings; ++ring) {
        std::vector<Plug>& plugs = columns_[static_cast<std::size_t>(ring)].plugs;
        const double moved = ring_speed(ring) * volume / volume_;  // of the length
        double left = moved;
        while (left > 0 && !plugs.empty()) {
            Plug& last = plugs.back();
            const double part = std::min(left, last.length);
            out += volume_ / rings * part * last.iodine;
            left -= part;
            last.length -= part;
            if (last.length >= shortest_plug) continue;
            out += volume_ / rings * last.length * last.iodine;
            plugs.pop_back();
        }
        if (left > 0) out += volume_ / rings * left * iodine;
        double there = 0;
        for (const Plug& plug : plugs) there += plug.length;
        const double length = 1 - there;
        if (!plugs.empty() && std::abs(plugs.front().iodine - iodine) < as_good_as_alike) {
            Plug& first = plugs.front();
            first.iodine = (first.length * first.iodine + length * iodine) / (first.length + length);
            first.length += length;
        } else {
            plugs.insert(plugs.begin(), {length, iodine});
        }
    }
    return out;
}

double Bore::iodine() const {
    double sum = 0;
    for (const Column& column : columns_)
        for (const Plug& plug : column.plugs) sum += plug.length * plug.iodine;
    return volume_ / rings * sum;
}

std::vector<float> Bore::profile(int parts) const {
    if (iodine() == 0) return {};
    std::vector<double> mass(static_cast<std::size_t>(parts), 0.0);
    for (const Column& column : columns_) {
        double from = 0;
        for (const Plug& plug : column.plugs) {
            const double to = from + plug.length;
            if (plug.iodine > 0) {
                const int last = std::min(parts - 1, static_cast<int>(to * parts));
                for (int k = std::max(0, static_cast<int>(from * parts)); k <= last; ++k)
                    mass[static_cast<std::size_t>(k)] +=
                        plug.iodine *
                        std::max(0.0, std::min(to * parts, k + 1.0) - std::max(from * parts, 0.0 + k));
            }
            from = to;
        }
    }
    std::vector<float> mean(mass.size());
    std::ranges::transform(mass, mean.begin(), [](double m) { return static_cast<float>(m / rings); });
    return mean;
}

}  // namespace blood

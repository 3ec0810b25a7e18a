#include "engine/studies/random_profile.h"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace studies {

physics::WallStiffness random_profile(double k, double length, std::uint64_t seed, int realisation) {
    std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                           static_cast<std::uint32_t>(realisation)};
    std::mt19937_64 random(sequence);
    const auto uniform = [&] { return std::ldexp(static_cast<double>(random() >> 11), -53); };
    std::vector<physics::WallStiffness::Term> terms;
    for (int g = 1; g <= profile_terms; ++g) {
        const double amplitude = std::ldexp(k, -g) * uniform();
        terms.push_back({amplitude, 2 * std::numbers::pi * uniform()});
    }
    return {k, length, terms};
}

}  // namespace studies

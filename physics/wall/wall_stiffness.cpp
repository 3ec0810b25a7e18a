#include "physics/wall/wall_stiffness.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "physics/geometry/maths.h"

namespace physics {

WallStiffness::WallStiffness(double mean, double length, std::vector<Term> terms)
    : mean_(mean), length_(length), terms_(std::move(terms)) {
    if (!std::isfinite(mean_) || mean_ <= 0) throw std::invalid_argument("wall stiffness must be > 0");
    if (!std::isfinite(length_) || length_ <= 0)
        throw std::invalid_argument("the length of a profile of wall stiffness must be > 0");
    double most = 0;
    for (const Term& term : terms_) {
        if (!std::isfinite(term.amplitude) || !std::isfinite(term.phase))
            throw std::invalid_argument("a profile of wall stiffness has a term that is not finite");
        most += std::abs(term.amplitude);
    }
    if (most >= mean_)
        throw std::invalid_argument("the terms of a profile of wall stiffness must add up to less than k");
}

double WallStiffness::at(double arc) const {
    const double w = std::numbers::pi * std::clamp(arc / length_, 0.0, 1.0);
    double sum = mean_, g = 0;
    for (const Term& term : terms_) sum += term.amplitude * geometry::cos(++g * w + term.phase);
    return sum;
}

double WallStiffness::slope(double arc) const {
    if (arc <= 0 || arc >= length_) return 0;
    const double unit = std::numbers::pi / length_;
    double sum = 0, g = 0;
    for (const Term& term : terms_) {
        g += unit;
        sum -= g * term.amplitude * geometry::sin(g * arc + term.phase);
    }
    return sum;
}

double WallStiffness::average(double from, double to) const {
    const double unit = std::numbers::pi / length_;
    const auto integral = [&](double arc) {
        const double s = std::clamp(arc, 0.0, length_);
        double sum = mean_ * s + at(arc) * (arc - s), g = 0;
        for (const Term& term : terms_) {
            g += unit;
            sum += term.amplitude / g * geometry::sin(g * s + term.phase);
        }
        return sum;
    };
    return (integral(to) - integral(from)) / (to - from);
}

WallStiffness WallStiffness::per(double joint_length) const {
    if (!std::isfinite(joint_length) || joint_length <= 0)
        throw std::invalid_argument("a joint's length must be positive and finite");
    WallStiffness same = *this;
    same.joint_length_ = joint_length;
    return same;
}

void WallStiffness::apply(const CentrelineCoordinate& place, WallContact& contact) const {
    contact.stiffness = at(place.arc);
    contact.stiffening = slope(place.arc) * place.gradient;
}

WallStiffness WallVariation::of(double mean, double whole) const {
    std::vector<WallStiffness::Term> given = terms;
    while (!given.empty() && given.back().amplitude == 0) given.pop_back();
    for (WallStiffness::Term& term : given) term.amplitude *= mean;
    return {mean, length == 0 ? whole : length, std::move(given)};
}

double WallVariation::sum() const {
    double sum = 0;
    for (const WallStiffness::Term& term : terms) sum += std::abs(term.amplitude);
    return sum;
}

void WallVariation::state(StateStream& s) {
    s(length);
    for (WallStiffness::Term& term : terms) s(term.amplitude, term.phase);
}

WallVariation drawn_variation(std::uint64_t seed, int terms, int realisation) {
    std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                           static_cast<std::uint32_t>(realisation)};
    std::mt19937_64 random(sequence);
    const auto uniform = [&] { return std::ldexp(static_cast<double>(random() >> 11), -53); };
    WallVariation variation;
    for (int g = 1; g <= terms; ++g) {
        const double amplitude = std::ldexp(uniform(), -g);
        variation.terms.push_back({amplitude, 2 * std::numbers::pi * uniform()});
    }
    return variation;
}

}  // namespace physics

#pragma once
/// A bent tube with a straight run beyond the bend, out of which a wire is drawn against a weight: a capstan
/// in closed form.

#include <cmath>

#include "engine/anatomy/scenes.h"
#include "physics/geometry/vec.h"

namespace test {

struct Capstan {
    static constexpr double radius = 20, lumen = 1, entry = 20, run = 200;  // [mm]
    static constexpr double weight = 0.01;                                  // [N/mm]
    double angle;                                                           // of the bend [rad]
    geometry::Polyline line, way;                                           // the tube's, and the wire's
    geometry::Vec3 beyond;                                                  // along the run, unit

    explicit Capstan(double bend) : angle(bend) {
        const auto path = [&](double r) {
            return anatomy::draw(std::vector<anatomy::PenMove>{anatomy::Run{entry}, anatomy::Arc{r, angle},
                                                               anatomy::Run{run + 60}});
        };
        line = path(radius);
        // The wire comes in at the inner wall, or the introducer would bear part of its turn.
        way = path(radius - lumen);
        for (geometry::Vec3& p : way) p.y() += lumen;
        beyond = (line.back() - line[line.size() - 2]).normalized();
    }
    double length() const { return entry + radius * angle + run; }
    geometry::Vec3 load() const { return weight * beyond; }
    /// Of a wire drawn out by the friction mu, with so much inside: T' = mu |T/R + w_n| + w_t along the inner
    /// wall, from the distal end of the bend to the introducer [N].
    double tension(double mu, double inserted) const {
        const double inner = radius - lumen;
        double sum = weight * (inserted - entry - inner * angle);
        constexpr int steps = 10'000;
        for (int k = 0; k < steps; ++k) {
            const double at = (k + 0.5) * angle / steps, press = sum / inner + weight * std::sin(at);
            sum += (weight * std::cos(at) + mu * press) * inner * angle / steps;
        }
        return sum + entry * weight * (std::cos(angle) + mu * std::sin(angle));
    }
};

}  // namespace test

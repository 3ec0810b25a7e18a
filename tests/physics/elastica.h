#pragma once
/// The exact plane curve of an inextensible wire clamped at one end, by integrating its differential
/// equation: the reference for chains of segments.

#include <algorithm>
#include <array>
#include <cmath>

/// A force F at the tip and a load w per length, both along −y, on a wire of length L clamped at the origin:
///   EI φ″ = (F + w (L − s)) cos φ,   φ′(L) = 0,   φ the angle from the x axis.
struct Elastica {
    double rigidity = 1, length = 1;          // EI, L
    double tip_force = 0, load = 0;           // F, w
    double clamp_angle = 0, tip_angle = 0;    // φ(0), φ(L)
    double x = 0, y = 0, bending_energy = 0;  // of the tip; ½ EI ∫ φ′²

    /// From the tip back to the clamp, by 4000 steps of Runge and Kutta's fourth order.
    void integrate() {
        constexpr int steps = 4000;
        const double h = length / steps;
        std::array<double, 5> at = {tip_angle, 0, 0, 0, 0};  // φ, φ′, and what is distal: x, y, energy
        const auto slope = [&](const std::array<double, 5>& v, double distal) -> std::array<double, 5> {
            return {-v[1], -(tip_force + load * distal) * std::cos(v[0]) / rigidity, std::cos(v[0]),
                    std::sin(v[0]), 0.5 * rigidity * v[1] * v[1]};
        };
        const auto plus = [](std::array<double, 5> v, double t, const std::array<double, 5>& d) {
            for (int i = 0; i < 5; ++i) v[i] += t * d[i];
            return v;
        };
        for (int i = 0; i < steps; ++i) {
            const double d = i * h;
            const auto a = slope(at, d), b = slope(plus(at, h / 2, a), d + h / 2),
                       c = slope(plus(at, h / 2, b), d + h / 2), e = slope(plus(at, h, c), d + h);
            for (int k = 0; k < 5; ++k) at[k] += h / 6 * (a[k] + 2 * b[k] + 2 * c[k] + e[k]);
        }
        clamp_angle = at[0], x = at[2], y = at[3], bending_energy = at[4];
    }

    /// Finds φ(L) for a given φ(0); the two rise together as long as the tip is not turned back.
    void clamp_at(double angle) {
        double low = -1.57, high = 1.57;
        for (int i = 0; i < 60; ++i) {
            tip_angle = 0.5 * (low + high);
            integrate();
            (clamp_angle < angle ? low : high) = tip_angle;
        }
    }

    /// Finds F too, for a given φ(0) and height of the tip, which the force lowers.
    void rest_at(double angle, double height) {
        double low = 0, high = 10 * rigidity / (length * length);
        for (int i = 0; i < 60; ++i) {
            tip_force = 0.5 * (low + high);
            clamp_at(angle);
            (y > height ? low : high) = tip_force;
        }
    }
};

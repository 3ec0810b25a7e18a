#pragma once
/// What the parts of Treatment share: where a device lies along the chain, and how wide it is there.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/exercise/treatment.h"
#include "physics/geometry/maths.h"

namespace exercise {

inline constexpr double seen_step = 0.1;  // of a lumen's radius in the image [mm]

inline double folded_radius(const scenario::Device& device) {
    return std::max(0.5 * device.outer_diameter, device.balloon ? 0.5 * device.balloon->law.profile : 0.0);
}

/// Of a balloon's diameter at a distance from its device's tip: less in its cones.
inline double fraction_at(const scenario::Balloon& balloon, double from_tip) {
    const double s = from_tip - balloon.from_tip, out = std::max({0.0, -s, s - balloon.length});
    if (out == 0) return 1;
    return balloon.cone > 0 ? std::max(0.0, 1 - out / balloon.cone) : 0.0;
}

/// Of a tube's axis from the vessel's, whose lumen has lost so much of its radius [mm].
inline geometry::Vec3 aside_of(const scenario::LesionSpec& spec, const BranchStretch& stretch, std::size_t k,
                               double lost) {
    return spec.eccentricity * lost * (geometry::rotation(spec.angle, stretch.along[k]) * stretch.side[k]);
}

/// The chain, by the way along it from the introducer, with the device that has the balloon.
class Treatment::Along {
public:
    Along(const physics::Chain& chain, int which, const scenario::Device* device)
        : chain_(chain), which_(which), device_(device) {
        arcs_.push_back(0);
        for (int i = 1; i <= chain.segments(); ++i) arcs_.push_back(arcs_.back() + chain.lengths[i]);
    }
    const scenario::Device& device() const { return *device_; }
    const scenario::Balloon* balloon() const {
        return device_ && device_->balloon ? &*device_->balloon : nullptr;
    }
    double length() const { return arcs_.back(); }
    /// Of the device's tip [mm].
    double tip() const { return which_ < 0 ? 0.0 : chain_.devices[which_].inserted; }
    geometry::Vec3 point(double arc) const {
        const int i = segment(arc);
        return chain_.joints[i - 1] + (arc - arcs_[i - 1]) * chain_.tangents[i];
    }
    geometry::Vec3 tangent(double arc) const { return chain_.tangents[segment(arc)]; }
    /// Of the nearest place; NaN where the chain passes by no nearer than `within`.
    double arc_of(const geometry::Vec3& x, double within) const {
        double best = within, found = std::numeric_limits<double>::quiet_NaN();
        for (int i = 1; i <= chain_.segments(); ++i) {
            const double s =
                std::clamp((x - chain_.joints[i - 1]).dot(chain_.tangents[i]), 0.0, chain_.lengths[i]);
            const double away = (x - chain_.joints[i - 1] - s * chain_.tangents[i]).norm();
            if (away < best) best = away, found = arcs_[i - 1] + s;
        }
        return found;
    }
    /// Radius of the outermost device there, an inflated balloon aside; 0 beyond them all [mm].
    double device_radius(double arc) const {
        double radius = 0;
        for (int k = 0; k < static_cast<int>(chain_.devices.size()); ++k) {
            const physics::Device& device = chain_.devices[k];
            if (device.inserted <= arc) continue;
            double own = 0.5 * device.spec.outer_diameter;
            if (k == which_ && balloon() && fraction_at(*balloon(), device.inserted - arc) > 0)
                own = folded_radius(*device_);
            radius = std::max(radius, own);
        }
        return radius;
    }
    /// Whether another device lies around the one with the balloon there.
    bool covered(double arc) const {
        for (int k = which_ + 1; which_ >= 0 && k < static_cast<int>(chain_.devices.size()); ++k)
            if (chain_.devices[k].inserted > arc) return true;
        return false;
    }
    /// How much of a stretch, by distances from the device's tip, is outside the body or in another device
    /// [mm].
    double covered_of(double from, double to) const {
        double most = 0;
        for (int k = which_ + 1; k < static_cast<int>(chain_.devices.size()); ++k)
            most = std::max(most, chain_.devices[k].inserted);
        return std::clamp(most - (tip() - to), 0.0, to - from);
    }
    physics::Loads loads(double arc, const Inflation* inflation) const {
        physics::Loads loads;
        loads.device = device_radius(arc);
        if (!balloon() || !inflation || !inflation->inflated() || covered(arc)) return loads;
        loads.fraction = fraction_at(*balloon(), tip() - arc);
        if (loads.fraction > 0) loads.balloon = &balloon()->law, loads.pressure = inflation->pressure;
        return loads;
    }

private:
    int segment(double arc) const {
        const auto after = std::upper_bound(arcs_.begin() + 1, arcs_.end() - 1, arc);
        return static_cast<int>(after - arcs_.begin());
    }
    const physics::Chain& chain_;
    int which_;
    const scenario::Device* device_;
    std::vector<double> arcs_;
};

}  // namespace exercise

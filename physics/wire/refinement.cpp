#include "physics/wire/refinement.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "physics/geometry/maths.h"

namespace physics {
namespace {

constexpr double merge_fraction = 0.5;  // of the tolerance that a merged pair may use
constexpr double touch_fraction =
    0.1;  // of the tolerance: a joint as near to the wall as this counts as lying on it

class Refinement {
public:
    Refinement(Chain& wire, const LumenWall& wall, const RefinementOptions& options)
        : wire_(wire), wall_(wall), options_(options) {
        // The distal end of every device stays as it is: shape, soft tip, and the segment that grows.
        const double lambda = wire.grid.segment_length, length = wire.inserted_length();
        for (const Device& device : wire.devices) {
            if (device.inserted <= 0) continue;
            double fine = std::max(shaped_length(device.spec), lambda);
            if (device.spec.sections.size() > 1) fine = std::max(fine, device.spec.sections.front().length);
            const auto [from, to] = std::pair(device.inserted - fine - options.fine_length, device.inserted);
            fine_.push_back({static_cast<int>(std::floor((length - to) / lambda)),
                             static_cast<int>(std::ceil((length - from) / lambda))});
            assert(fine_.back().from < fine_.back().to);
        }
        measure();
    }

    int split() {
        [[maybe_unused]] const int whole = start_.back();
        int count = 0;
        for (bool changed = true; changed;) {
            changed = false;
            for (int i = 1; i <= wire_.segments(); ++i) {
                if (!too_long(i)) continue;
                split_segment(wire_, i);
                measure();
                assert(start_.back() == whole);
                ++count;
                changed = true;
            }
        }
        return count;
    }

    int merge() {
        [[maybe_unused]] const int whole = start_.back();
        int count = 0;
        for (bool changed = true; changed;) {
            changed = false;
            for (int i = 1; i < wire_.segments(); ++i) {
                if (!mergeable(i)) continue;
                merge_segments(wire_, i);
                measure();
                assert(start_.back() == whole);
                ++count;
                changed = true;
            }
        }
        return count;
    }

private:
    /// Lengths and places in whole λ; the segment that grows, λ/2 to 3λ/2 long, counts as one.
    void measure() {
        const int n = wire_.segments(), growing = wire_.growing();
        start_.assign(n + 2, 0);
        for (int i = 1; i <= n; ++i) {
            const double units = wire_.lengths[i] / wire_.grid.segment_length;
            assert(i == wire_.growing() || std::abs(units - std::round(units)) < 1e-6);
            assert(i == wire_.growing() || std::has_single_bit(static_cast<unsigned>(std::lround(units))));
            // Rounded, the one that grows could also be none or two, and be split for ever.
            const bool grows = i == growing;
            start_[i + 1] = start_[i] + (grows ? 1 : static_cast<int>(std::lround(units)));
        }
    }
    int units(int i) const { return start_[i + 1] - start_[i]; }
    bool kept_fine(int first_unit, int last_unit) const {
        assert(first_unit < last_unit);
        const int whole = start_.back();
        return first_unit == 0 || std::any_of(fine_.begin(), fine_.end(), [&](const Fine& fine) {
                   return last_unit > whole - fine.to && first_unit < whole - fine.from;
               });
    }

    double curvature(int joint) const {
        assert(joint >= 0 && joint <= wire_.segments());
        if (joint == wire_.segments()) return 0;
        return (wire_.tangents[joint + 1] - wire_.tangents[joint]).norm() / wire_.length_of(joint);
    }

    bool too_long(int i) {
        const int length = units(i);
        if (length == 1) return false;
        if (length > options_.longest || kept_fine(start_[i], start_[i + 1])) return true;
        if (i > 1 && length > 2 * units(i - 1)) return true;
        if (i < wire_.segments() && length > 2 * units(i + 1)) return true;
        const double bent = std::max(curvature(i - 1), curvature(i));
        return !represents(i, wire_.tangents[i], length, bent, options_.curve_tolerance);
    }

    bool mergeable(int i) {
        const int half = units(i), length = 2 * half;
        if (units(i + 1) != half || length > options_.longest || start_[i] % length != 0) return false;
        if (kept_fine(start_[i], start_[i + 2])) return false;
        if (i > 1 && units(i - 1) < half) return false;
        if (i + 1 < wire_.segments() && units(i + 2) < half) return false;
        const double bent = std::max({curvature(i - 1), curvature(i), curvature(i + 1)});
        const Vec3 chord = (wire_.tangents[i] + wire_.tangents[i + 1]).normalized();
        return represents(i, chord, length, bent, merge_fraction * options_.curve_tolerance);
    }

    /// Whether a straight segment from joint i − 1 is as good as the curve, within the tolerance.
    bool represents(int i, const Vec3& along, int length, double bent, double tolerance) {
        assert(i >= 1 && length >= 1 && bent >= 0 && tolerance > 0);
        const double lambda = wire_.grid.segment_length;
        if (!(bent * geometry::pow(length * lambda, 2) / 8 <= tolerance)) return false;
        points_.clear();
        contacts_.assign(length + 1, {});
        for (int k = 0; k <= length; ++k) {
            points_.push_back(wire_.joints[i - 1] + k * lambda * along);
            contacts_[k].station = wire_.stations[i - 1];
        }
        wall_.contacts(points_, contacts_);
        const auto [least, most] = std::minmax_element(
            contacts_.begin(), contacts_.end(),
            [](const WallContact& a, const WallContact& b) { return a.penetration < b.penetration; });
        const double ends = std::max({0.0, contacts_.front().penetration, contacts_.back().penetration});
        if (most->penetration > ends + tolerance) return false;
        const double near = touch_fraction * (options_.curve_tolerance - tolerance);
        return most->penetration <= -near || least->penetration >= -touch_fraction * tolerance;
    }

    Chain& wire_;
    const LumenWall& wall_;
    RefinementOptions options_;
    /// Kept at λ, by the distances from the distal end [λ].
    struct Fine {
        int from = 0, to = 0;
    };
    std::vector<Fine> fine_;
    std::vector<int> start_;  // [i] = of segment i from the introducer [λ]; [N+1] is the whole length
    std::vector<Vec3> points_;
    std::vector<WallContact> contacts_;
};

}  // namespace

std::vector<std::string> problems(const RefinementOptions& o) {
    std::vector<std::string> out;
    if (!std::isfinite(o.curve_tolerance) || o.curve_tolerance <= 0 || o.curve_tolerance > 10)
        out.push_back("curve_tolerance must lie in (0, 10] mm.");
    if (o.longest < 1 || o.longest > 1024 || !std::has_single_bit(static_cast<unsigned>(o.longest)))
        out.push_back("longest must be a power of two from 1 to 1024.");
    if (!std::isfinite(o.fine_length) || o.fine_length < 0 || o.fine_length > 1000)
        out.push_back("fine_length must lie in [0, 1000] mm.");
    return out;
}

RefinementReport refine(Chain& wire, const LumenWall& wall, const RefinementOptions& options) {
    assert(problems(options).empty());
    Refinement refinement(wire, wall, options);
    RefinementReport report;
    report.split = refinement.split();
    report.merged = refinement.merge();
    return report;
}

}  // namespace physics

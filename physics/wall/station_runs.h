#pragma once
/// Searches over stations that skip most of them.

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "physics/geometry/centreline_tree.h"

namespace physics {

/// Stations in runs, each enclosed in a sphere, and runs in groups likewise. The caller keeps the stations.
class StationRuns {
public:
    StationRuns(std::span<const Station> stations, std::vector<int> chosen)
        : stations_(stations), chosen_(std::move(chosen)) {
        for (int first = 0; first < static_cast<int>(chosen_.size()); first += fixed_length) {
            const int last = std::min(first + fixed_length, static_cast<int>(chosen_.size()));
            runs_.push_back(sphere(first, last, first, last));
        }
        for (int first = 0; first < static_cast<int>(runs_.size()); first += fixed_length) {
            const int last = std::min(first + fixed_length, static_cast<int>(runs_.size()));
            groups_.push_back(sphere(first, last, runs_[first].first, runs_[last - 1].last));
        }
    }

    /// The first of the stations that hold x deepest. `seed` is a station likely to be it, -1 = none.
    int deepest(const Vec3& x, int seed) const {
        return deepest(x, seed, [](int) { return true; });
    }
    /// The same among the stations that `accept` lets pass, including the seed; -1 when it lets none pass.
    template <class Accept>
    int deepest(const Vec3& x, int seed, const Accept& accept) const {
        int best = seed;
        double least = seed >= 0 ? stations_[seed].power(x) : std::numeric_limits<double>::infinity();
        const auto passed_over = [&](const Sphere& sphere) {
            const double gap = std::max(0.0, (x - sphere.centre).norm() - sphere.reach);
            return gap * gap - sphere.widest * sphere.widest > least + rounding_fraction;
        };
        for (const Sphere& group : groups_) {
            if (passed_over(group)) continue;
            for (int r = group.begin; r < group.end; ++r) {
                if (passed_over(runs_[r])) continue;
                for (int i = runs_[r].first; i < runs_[r].last; ++i) {
                    const int s = chosen_[i];
                    const double p = stations_[s].power(x);
                    if ((p < least || (p == least && s < best)) && accept(s)) least = p, best = s;
                }
            }
        }
        return best;
    }
    /// Whether x is within this many radii and a margin [mm] of a station.
    bool near(const Vec3& x, double radii, double margin) const {
        return std::any_of(runs_.begin(), runs_.end(), [&](const Sphere& run) {
            const double most = run.reach + radii * run.widest + margin + rounding_fraction;
            if ((x - run.centre).squaredNorm() > most * most) return false;
            return std::any_of(chosen_.begin() + run.first, chosen_.begin() + run.last, [&](int s) {
                const double limit = radii * stations_[s].radius + margin;
                return (x - stations_[s].centre).squaredNorm() < limit * limit;
            });
        });
    }

private:
    static constexpr int fixed_length = 16;
    static constexpr double rounding_fraction = 1e-6;
    struct Sphere {
        int begin, end;   // of a run: in `chosen_`; of a group: in `runs_`
        int first, last;  // in `chosen_`
        Vec3 centre;
        double reach = 0, widest = 0;  // of the stations' centres, and their largest radius [mm]
    };
    Sphere sphere(int begin, int end, int first, int last) const {
        Sphere sphere{begin, end, first, last, stations_[chosen_[(first + last) / 2]].centre};
        for (int i = first; i < last; ++i) {
            const Station& station = stations_[chosen_[i]];
            sphere.reach = std::max(sphere.reach, (station.centre - sphere.centre).norm());
            sphere.widest = std::max(sphere.widest, station.radius);
        }
        return sphere;
    }

    std::span<const Station> stations_;
    std::vector<int> chosen_;
    std::vector<Sphere> runs_, groups_;
};

}  // namespace physics

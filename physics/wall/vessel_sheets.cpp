#include "physics/wall/vessel_sheets.h"

#include <algorithm>
#include <queue>

namespace physics {
namespace {

constexpr double length_rounding = 1e-6;  // of sums of lengths [mm]

/// For each station, the largest value over all stations of radius less half the way there along the vessels:
/// no station beyond it is seen from farther than twice the sum of that value and the looker's radius.
std::vector<double> widest_beyond(const CentrelineTree& tree) {
    std::vector<double> widest;
    std::priority_queue<std::pair<double, int>> open;
    for (const Station& station : tree.stations()) {
        open.push({station.radius, static_cast<int>(widest.size())});
        widest.push_back(station.radius);
    }
    while (!open.empty()) {
        const auto [radius, s] = open.top();
        open.pop();
        if (radius < widest[s]) continue;
        for (int t : tree.neighbours(s)) {
            const double there =
                radius - 0.5 * (tree.stations()[t].centre - tree.stations()[s].centre).norm();
            if (there <= widest[t]) continue;
            widest[t] = there;
            open.push({there, t});
        }
    }
    return widest;
}

/// Stations within reach along the vessels (Dijkstra's algorithm, stopped there).
std::vector<int> seen_from(const CentrelineTree& tree, int from, const std::vector<double>& widest,
                           std::vector<double>& distance, std::vector<int>& entries) {
    const auto stations = tree.stations();
    const auto enters = [&](int s) {
        return stations[s].branch != stations[from].branch &&
               std::ranges::none_of(entries, [&](int e) { return stations[e].branch == stations[s].branch; });
    };
    using Entry = std::pair<double, int>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    std::vector<int> touched{from}, seen;
    distance[from] = 0;
    open.push({0.0, from});
    while (!open.empty()) {
        const auto [length, s] = open.top();
        open.pop();
        if (length > distance[s]) continue;
        // A station always sees its own neighbours, however far apart the samples are.
        const auto next = tree.neighbours(from);
        if (length <= 2 * (stations[from].radius + stations[s].radius) ||
            std::find(next.begin(), next.end(), s) != next.end()) {
            seen.push_back(s);
            if (enters(s)) entries.push_back(s);
        }
        for (int t : tree.neighbours(s)) {
            const double there = length + (stations[t].centre - stations[s].centre).norm();
            const double reach = 2 * (stations[from].radius + widest[t]) + length_rounding;
            if ((there > reach && s != from) || there >= distance[t]) continue;
            if (distance[t] == std::numeric_limits<double>::max()) touched.push_back(t);
            distance[t] = there;
            open.push({there, t});
        }
    }
    for (int s : touched) distance[s] = std::numeric_limits<double>::max();
    std::sort(seen.begin(), seen.end());
    return seen;
}

/// The station of one branch that holds x deepest, downhill from another one of it.
int deepest_on_branch(std::span<const Station> stations, const Vec3& x, int from) {
    const int count = static_cast<int>(stations.size());
    for (int best = from;; from = best) {
        for (const int s : {from - 1, from + 1})
            if (s >= 0 && s < count && stations[s].branch == stations[from].branch &&
                stations[s].power(x) < stations[best].power(x))
                best = s;
        if (best == from) return best;
    }
}

}  // namespace

int SheetMap::gone_over(const CentrelineTree& tree, const Vec3& x, int own) const {
    const auto stations = tree.stations();
    if (stations[own].power(x) <= 0) return own;
    int best = own;
    for (const int entry : entries[own]) {
        const int other = deepest_on_branch(stations, x, entry);
        const double radius = stations[other].radius, power = stations[other].power(x);
        // The power grows by about twice the radius times the way past the border, or out of the ball.
        if (power < 0.25 * radius * radius && power + 0.5 * radius * radius < stations[own].power(x) &&
            power < stations[best].power(x))
            best = other;
    }
    return best;
}

VesselSheets vessel_sheets(const CentrelineTree& tree, const std::function<double(double)>& near) {
    const auto stations = tree.stations();
    const int count = static_cast<int>(stations.size());
    const std::vector<double> widest = widest_beyond(tree);
    VesselSheets sheets;
    std::vector<double> distance(count, std::numeric_limits<double>::max());
    sheets.map.entries.resize(count);
    for (int s = 0; s < count; ++s)
        sheets.seen.push_back(seen_from(tree, s, widest, distance, sheets.map.entries[s]));
    auto sees = [&](int a, int b) {
        return std::binary_search(sheets.seen[a].begin(), sheets.seen[a].end(), b);
    };

    std::vector<double> along(count, 0.0);  // the stations, from any start
    double widest_radius = 0;
    std::vector<double> nears;
    for (int s = 0; s < count; ++s) {
        if (s > 0) along[s] = along[s - 1] + (stations[s].centre - stations[s - 1].centre).norm();
        widest_radius = std::max(widest_radius, stations[s].radius);
        nears.push_back(near(stations[s].radius));
    }
    const double largest_near = near(widest_radius);
    /// Whether a station comes near one from `first` to its predecessor without seeing it.
    const auto comes_near = [&](int first, int s) {
        for (int t = first; t < s;) {
            const double gap = (stations[s].centre - stations[t].centre).norm();
            const double reach = stations[s].radius + stations[t].radius + std::max(nears[s], nears[t]);
            if (gap < reach && !sees(s, t)) return true;
            // The next stations are nearer by no more than the way along the vessel to them.
            const double past =
                along[t] + gap - (stations[s].radius + widest_radius + largest_near) - length_rounding;
            for (++t; t < s && along[t] < past;) ++t;
        }
        return false;
    };
    for (int s = 0; s < count; ++s) {
        bool fresh = s == 0 || stations[s].branch != stations[s - 1].branch;
        if (!fresh) fresh = comes_near(sheets.stations.back().front(), s);
        if (fresh) sheets.stations.emplace_back();
        sheets.stations.back().push_back(s);
        sheets.map.sheet_of.push_back(static_cast<int>(sheets.stations.size()) - 1);
    }

    sheets.ends.resize(count);
    for (std::size_t e = 0; e < tree.ends().size(); ++e) {
        const int at = tree.locate(tree.ends()[e].centre, -1);
        for (int s : sheets.seen[at]) sheets.ends[s].push_back(static_cast<int>(e));
    }
    return sheets;
}

}  // namespace physics

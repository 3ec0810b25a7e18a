#include "engine/anatomy/vessel_paths.h"

#include <gtest/gtest.h>
#include <queue>
#include <random>

#include "engine/anatomy/grow/generator.h"
#include "tests/anatomies.h"
#include "tests/engine/anatomy/trees.h"

namespace anatomy {
namespace {

/// Dijkstra's way over all samples of all branches, a step for each pair of neighbours.
std::optional<double> way_over_samples(const Anatomy& anatomy, const VesselPlace& from,
                                       const VesselPlace& to) {
    std::vector<int> first;
    std::vector<std::vector<std::pair<int, double>>> next;
    for (const geometry::CentrelineBranch& branch : anatomy.branches) {
        first.push_back(static_cast<int>(next.size()));
        next.resize(next.size() + branch.points.size());
    }
    const auto step = [&next](int a, int b, double length) {
        next[a].emplace_back(b, length);
        next[b].emplace_back(a, length);
    };
    for (int b = 0; b < static_cast<int>(first.size()); ++b) {
        const geometry::CentrelineBranch& branch = anatomy.branches[b];
        const int count = static_cast<int>(branch.points.size());
        for (int i = 1; i < count; ++i)
            step(first[b] + i - 1, first[b] + i, (branch.points[i] - branch.points[i - 1]).norm());
        if (branch.parent >= 0) step(first[b], first[branch.parent] + branch.parent_sample, 0);
        if (const auto joint = joint_of(anatomy, b))
            step(first[b] + count - 1, first[joint->branch] + joint->sample, 0);
    }
    std::vector<double> way(next.size(), -1);
    std::priority_queue<std::pair<double, int>> open;
    open.emplace(0, first[from.branch] + from.sample);
    while (!open.empty()) {
        const auto [minus, at] = open.top();
        open.pop();
        if (way[at] >= 0) continue;
        way[at] = -minus;
        for (const auto& [neighbour, length] : next[at])
            if (way[neighbour] < 0) open.emplace(minus - length, neighbour);
    }
    const double found = way[first[to.branch] + to.sample];
    return found < 0 ? std::nullopt : std::optional(found);
}

const geometry::Vec3& at(const Anatomy& anatomy, int branch, int sample) {
    return anatomy.branches[branch].points[sample];
}

/// Pieces that follow one another, and points on them at the distance that is asked for.
void check_route(const Anatomy& anatomy, const std::vector<VesselPaths::Piece>& route,
                 const VesselPlace& from, const VesselPlace& to, double length) {
    ASSERT_FALSE(route.empty());
    std::vector<geometry::Vec3> line;
    for (const VesselPaths::Piece& piece : route)
        for (int s = piece.from;; s += piece.from <= piece.to ? 1 : -1) {
            line.push_back(at(anatomy, piece.branch, s));
            if (s == piece.to) break;
        }
    EXPECT_EQ(line.front(), at(anatomy, from.branch, from.sample));
    EXPECT_EQ(line.back(), at(anatomy, to.branch, to.sample));
    constexpr double spacing = 3;
    std::vector<geometry::Vec3> points(40);
    points_on(anatomy, route, spacing, points);
    // The same points by walking the line in small steps: where pieces meet it jumps from axis to axis.
    double gone = 0, next = spacing;
    std::size_t k = 0;
    for (std::size_t i = 1; i < line.size() && k < points.size(); ++i) {
        const double step = (line[i] - line[i - 1]).norm();
        for (; k < points.size() && next <= gone + step; next += spacing, ++k) {
            const geometry::Vec3 x = line[i - 1] + (next - gone) / step * (line[i] - line[i - 1]);
            EXPECT_LT((points[k] - x).norm(), 1e-6);
        }
        gone += step;
    }
    if (k < points.size()) {
        EXPECT_GE(gone, length - 1e-9);
    }
    for (; k < points.size(); ++k) EXPECT_LT((points[k] - line.back()).norm(), 1e-6);
}

}  // namespace

TEST(VesselPaths, AreTheShortestOverAllSamples) {
    for (const Anatomy& anatomy : {generate(test::small_loop()), generate(test::small_confluence()),
                                   Anatomy(test::small_anatomy()), Anatomy(test::iliac_renal())}) {
        const VesselPaths ways(anatomy);
        constexpr unsigned seed = 5;
        std::mt19937 random(seed);
        const auto any_place = [&] {
            VesselPlace place;
            place.branch = static_cast<int>(random() % anatomy.branches.size());
            place.sample = static_cast<int>(random() % anatomy.branches[place.branch].points.size());
            return place;
        };
        for (int k = 0; k < 100; ++k) {
            const VesselPlace a = any_place(), b = any_place();
            const std::optional<double> way = ways.between(a, b), truth = way_over_samples(anatomy, a, b);
            ASSERT_TRUE(way && truth) << anatomy.name;
            EXPECT_NEAR(*way, *truth, 1e-9) << anatomy.name << " " << a.branch << ":" << a.sample << " to "
                                            << b.branch << ":" << b.sample << ", seed " << seed;
            check_route(anatomy, ways.route(a, b), a, b, *way);
        }
    }
}

TEST(VesselPaths, NoneLeadsFromOneTreeToAnother) {
    Anatomy two = test::small_anatomy();
    geometry::CentrelineBranch apart = two.branches[0];
    apart.name = "apart";
    for (geometry::Vec3& p : apart.points) p.z() += 100;
    two.branches.push_back(apart);
    const VesselPaths ways(two);
    EXPECT_FALSE(ways.between({0, 3, 0}, {2, 3, 0}));
    EXPECT_TRUE(ways.between({0, 3, 0}, {1, 3, 0}));
    EXPECT_EQ(centreline_distance(two, {15, 0, 0}, {15, 0, 100}), 100);
}

}  // namespace anatomy

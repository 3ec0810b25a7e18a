#pragma once
/// Random vessel trees as programs segment them from CT: on a grid, closed, with steps, tips and gaps.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <random>

#include "physics/geometry/vec.h"

namespace test {

struct Ball {
    geometry::Vec3 centre;
    double radius;
};

/// Balls along a tree that forks at random into up to `tips` tips; each fork keeps the cube of the radius.
inline std::vector<Ball> random_tree(std::uint32_t seed, int tips, double step) {
    using geometry::Vec3;
    std::mt19937 random(seed);
    const auto between = [&](double low, double high) {
        return low + (high - low) * (random() / 4294967296.0);
    };
    struct Stem {
        Vec3 place, way;
        double radius;
    };
    std::deque<Stem> open = {{Vec3::Zero(), Vec3::UnitZ(), between(3, 6)}};
    std::vector<Ball> balls;
    for (int made = 1; !open.empty(); open.pop_front()) {
        Stem stem = open.front();
        const double length = stem.radius * between(7, 14);
        const int count = static_cast<int>(std::ceil(length / step));
        const double x = between(-1, 1), y = between(-1, 1), z = between(-1, 1);
        const double bend = between(0, 0.03) / std::max(1.0, stem.radius / 3) * length / count;
        const Eigen::AngleAxisd turn(bend, (Vec3(x, y, z) + Vec3(0, 0, 1e-3)).normalized());
        for (int i = 0; i <= count; ++i) {
            balls.push_back({stem.place, stem.radius * (1 - 0.15 * i / count)});
            stem.place += length / count * stem.way;
            stem.way = turn * stem.way;
        }
        const double radius = 0.85 * stem.radius;
        if (made >= tips || radius < 0.35) continue;
        ++made;
        const double ratio = between(0.6, 1), cube = ratio * ratio * ratio, fork = between(0.3, 1);
        const Vec3 side = Eigen::AngleAxisd(between(0, 6.28), stem.way) * stem.way.unitOrthogonal();
        open.push_back({stem.place, std::cos(0.8 * fork) * stem.way + std::sin(0.8 * fork) * side,
                        radius * std::cbrt(cube / (1 + cube))});
        open.push_back({stem.place, std::cos(0.5 * fork) * stem.way - std::sin(0.5 * fork) * side,
                        radius * std::cbrt(1 / (1 + cube))});
    }
    return balls;
}

/// The closed surface of the voxels whose centres the balls hold, smoothed (Taubin 1995) in `rounds`.
inline geometry::TriangleMesh segmented(const std::vector<Ball>& balls, double voxel, int rounds) {
    using geometry::Vec3;
    Vec3 low = Vec3::Constant(1e9), high = -low;
    for (const Ball& ball : balls) {
        low = low.cwiseMin(ball.centre - Vec3::Constant(ball.radius + 3 * voxel));
        high = high.cwiseMax(ball.centre + Vec3::Constant(ball.radius + 3 * voxel));
    }
    std::array<int, 3> size{};
    for (int k = 0; k < 3; ++k) size[k] = static_cast<int>((high - low)[k] / voxel) + 1;
    const auto index = [&](const std::array<int, 3>& p) {
        return (static_cast<std::size_t>(p[2]) * size[1] + p[1]) * size[0] + p[0];
    };
    std::vector<char> inside(static_cast<std::size_t>(size[0]) * size[1] * size[2], 0);
    for (const Ball& ball : balls) {
        const Eigen::Vector3i
            first = ((ball.centre - low).array() / voxel - ball.radius / voxel).ceil().cast<int>(),
            last = ((ball.centre - low).array() / voxel + ball.radius / voxel).floor().cast<int>();
        for (int z = first.z(); z <= last.z(); ++z)
            for (int y = first.y(); y <= last.y(); ++y)
                for (int x = first.x(); x <= last.x(); ++x)
                    if ((low + voxel * Vec3(x, y, z) - ball.centre).norm() <= ball.radius)
                        inside[index({x, y, z})] = 1;
    }
    // A corner for every cell of eight voxels that the surface passes through, a square for every face.
    geometry::TriangleMesh mesh;
    std::map<std::array<int, 3>, int> corners;
    const auto corner = [&](const std::array<int, 3>& cell) {
        const auto [at, fresh] = corners.try_emplace(cell, static_cast<int>(mesh.vertices.size()));
        if (fresh)
            mesh.vertices.push_back(low + voxel * (Vec3(cell[0], cell[1], cell[2]) + Vec3::Constant(0.5)));
        return at->second;
    };
    std::array<int, 3> p{};
    for (p[2] = 1; p[2] + 1 < size[2]; ++p[2]) {
        for (p[1] = 1; p[1] + 1 < size[1]; ++p[1]) {
            for (p[0] = 1; p[0] + 1 < size[0]; ++p[0]) {
                for (int k = 0; k < 3; ++k) {
                    std::array<int, 3> other = p;
                    ++other[k];
                    const bool here = inside[index(p)] != 0;
                    if (here == (inside[index(other)] != 0)) continue;
                    const int u = (k + 1) % 3, v = (k + 2) % 3;
                    std::array<int, 4> square{};
                    constexpr std::array<std::array<int, 2>, 4> around = {
                        {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}}};
                    for (int n = 0; n < 4; ++n) {
                        std::array<int, 3> cell = p;
                        cell[u] += around[n][0], cell[v] += around[n][1];
                        square[n] = corner(cell);
                    }
                    if (!here) std::swap(square[1], square[3]);
                    mesh.triangles.push_back({square[0], square[1], square[2]});
                    mesh.triangles.push_back({square[0], square[2], square[3]});
                }
            }
        }
    }
    for (int round = 0; round < 2 * rounds; ++round) {
        std::vector<Vec3> sums(mesh.vertices.size(), Vec3::Zero());
        std::vector<int> counts(mesh.vertices.size(), 0);
        for (const auto& t : mesh.triangles) {
            for (int k = 0; k < 3; ++k) {
                sums[t[k]] += mesh.vertices[t[(k + 1) % 3]] + mesh.vertices[t[(k + 2) % 3]];
                counts[t[k]] += 2;
            }
        }
        for (std::size_t i = 0; i < sums.size(); ++i)
            mesh.vertices[i] += (round % 2 == 0 ? 0.5 : -0.53) * (sums[i] / counts[i] - mesh.vertices[i]);
    }
    return mesh;
}

}  // namespace test

#pragma once
/// A cubic B-spline on a sparse grid: a twice continuously differentiable function known near a surface.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "physics/geometry/vec.h"

namespace geometry {

struct SplineValue {
    double value = 0;
    Vec3 gradient = Vec3::Zero();
    Mat3 hessian = Mat3::Zero();
};

/// Nodes lie at whole multiples of the spacing, in bricks of 4 × 4 × 4; brick (i, j, k) starts at node
/// (4i, 4j, 4k). A cell needs the 4 × 4 × 4 nodes around it, which lie in a brick and the seven on its upper
/// sides; where one of the eight is missing the spline is not known. A value is written at every node, then
/// `fit` turns values into coefficients; two grids that hold the same values around a place agree there.
class SplineGrid {
public:
    static constexpr int brick_side = 4;  // nodes along the edge of a brick
    static constexpr int node_count =
        brick_side * brick_side * brick_side;  // of a brick, the last coordinate fastest
    using Brick = std::array<int, 3>;

    /// Bricks in any order, each once. Throws std::invalid_argument for a spacing that is not positive or
    /// bricks more than 2²⁰ from the origin.
    SplineGrid(double spacing, std::vector<Brick> bricks);
    /// A grid whose bytes of save() lie elsewhere. They stay there as long as `held` lives, where they begin
    /// at an address that `alignment` divides; else, and where `held` is null, they are copied. Throws
    /// std::invalid_argument for a spacing that is not positive, and bytes that are too few.
    SplineGrid(double spacing, std::span<const std::byte> saved, std::shared_ptr<const void> held);
    static constexpr std::size_t alignment = 64;  // [bytes]
    SplineGrid(SplineGrid&&) noexcept = default;
    SplineGrid& operator=(SplineGrid&&) noexcept = default;
    /// Appends the fitted grid, as many bytes as `alignment` divides.
    void save(std::string&) const;
    /// Of a grid that save() has written there; more than there are where they are too few.
    static std::size_t saved_bytes(std::span<const std::byte>);

    std::size_t bricks() const { return at_.bricks.size(); }
    const Brick& brick(std::size_t b) const { return at_.bricks[b].at; }
    double spacing() const { return spacing_; }
    std::span<float> nodes(std::size_t b) { return nodes_[b].of; }  // of a grid that has its own
    std::span<const float> nodes(std::size_t b) const { return at_.nodes[b].of; }
    Vec3 place(std::size_t b, int i, int j, int k) const {
        return spacing_ *
               Vec3(brick_side * brick(b)[0] + i, brick_side * brick(b)[1] + j, brick_side * brick(b)[2] + k);
    }
    std::size_t bytes() const;

    /// The quasi-interpolant of order 4: for a smooth f its error is about h⁴ f⁗/36. Each coefficient comes
    /// from the 3 × 3 × 3 values around it, hence from its surroundings alone; beyond the grid's edge values
    /// are continued linearly. Where `coarse` (fitted, of twice the spacing) is known, a brick that lacks one
    /// of its 26 neighbours takes its coefficients from it. There the two grids are one function, so that a
    /// spline that uses this grid where it is known and the coarse one elsewhere is twice continuously
    /// differentiable.
    void fit(int threads = 1, const SplineGrid* coarse = nullptr);

    /// The spline at x with exact derivatives; false where it is not known.
    bool evaluate(const Vec3& x, SplineValue&) const;

private:
    struct Place {
        Brick at;
        std::array<std::int32_t, 8> upper;  // this brick and those on its upper sides, -1 = none
    };
    struct alignas(alignment) Nodes {  // four usual cache lines; a cell reads one for each x
        std::array<float, node_count> of{};
    };
    std::int32_t find(const Brick&) const;
    using Bricks = std::array<std::int32_t, 27>;
    /// This brick and those around it, the last coordinate fastest; -1 = none.
    Bricks around(const Brick&) const;
    /// The coefficient of a node in the grid of half the spacing. The node lies in the given brick, whose
    /// surroundings are the Bricks; nothing where one that it needs is missing.
    std::optional<float> subdivided(const std::array<int, 3>& node, const Brick&, const Bricks&) const;

    struct SavedHead;
    /// What is kept of a grid, here or elsewhere.
    struct Parts {
        std::span<const Nodes> nodes;  // values, then coefficients
        std::span<const Place> bricks;
        std::span<const std::int32_t> table;  // open-addressed hash table of bricks, -1 = free
    };
    /// Throws std::invalid_argument for bytes that are too few.
    static Parts parts_of(std::span<const std::byte> saved);

    double spacing_;
    Parts at_;
    std::vector<Nodes> nodes_;
    std::vector<Place> bricks_;
    std::vector<std::int32_t> table_;
    std::shared_ptr<const void> held_;
};

}  // namespace geometry

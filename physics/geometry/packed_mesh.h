#pragma once
/// Triangle meshes as few bits: where each corner is, and how triangles hang together.

#include <cstddef>
#include <memory>

#include "physics/geometry/range_coder.h"
#include "physics/geometry/vec.h"

namespace geometry {

constexpr std::int32_t most_steps = 1 << 20;  // from the origin
/// Whole steps nearest to a value. Throws std::runtime_error beyond most_steps, and for no number.
std::int32_t in_steps(double value, double step);
/// Packs or reads steps that are often near the expected ones. Throws std::runtime_error beyond
/// most_steps.
std::int32_t near(RangeCoder&, NumberModel&, std::int32_t expected, std::int32_t value);

/// How much may still be unpacked, in bytes as it is kept.
struct Allowance {
    std::size_t left;

    /// Throws std::runtime_error for more than that.
    void take(std::size_t count, std::size_t bytes);
    /// A count of things of so many bytes, packed or read, and taken.
    std::size_t count(RangeCoder&, NumberModel&, std::size_t count, std::size_t bytes);
};

/// Packs or reads meshes whose corners are multiples of a step, or are rounded to these. They come back in
/// the order of ordered(); a mesh in that order comes back bit for bit. What was learned from one mesh serves
/// the next. Throws std::runtime_error for what is no packed mesh.
class MeshCoder {
public:
    MeshCoder(RangeCoder&, Allowance&, double step);
    MeshCoder(const MeshCoder&) = delete;
    MeshCoder& operator=(const MeshCoder&) = delete;
    ~MeshCoder();
    /// What it packs, in order; nothing while it reads.
    TriangleMesh mesh(TriangleMesh&);

private:
    class Traversal;
    std::unique_ptr<Traversal> traversal_;
};

/// The mesh with corners and triangles in the order of MeshCoder, which follows from how they hang together.
/// Corners without a triangle are gone. A mesh in this order stays as it is, and so do meshes one after
/// another that share no corner.
TriangleMesh ordered(const TriangleMesh&);

/// Corners rounded to multiples of a step; 0 is never -0.
Vec3 on_grid(const Vec3&, double step);

}  // namespace geometry

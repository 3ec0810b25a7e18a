#pragma once
/// Texture of which a few numbers and one bit for each try are kept in place of its blobs: what the tries are
/// follows from the numbers and from the finished mesh, the bit says whether one is kept. Each blob comes
/// back to the bit, everywhere.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "physics/geometry/packed_mesh.h"
#include "physics/geometry/state.h"
#include "render/xray/texture_blobs.h"

namespace render {

/// Corners of a body's meshes are multiples of this [mm].
constexpr double corner_step = 0.05;

/// A place in which something is tried, and its size [mm].
struct TextureTry {
    geometry::Vec3 middle, axis;  // axis: unit
    double radius, length;        // length: over radius [-]
    double depth;                 // under the surface
};

struct TexturePattern {
    enum class Kind : std::uint32_t {
        Tissue,  // in a box of the straight body: low corner, size, origin of the body
        Grain,   // under triangles: tries for each mm², deepest, coarsest, the way that it runs, balance
        Plaques  // about triangles, all kept: thickness
    };
    Kind kind = Kind::Tissue;
    std::uint64_t field = 0, seed = 0;  // of its random numbers; of the patient
    std::array<double, 9> numbers{};
    std::uint64_t from = 0, to = 0;   // triangles of the layer's mesh
    std::vector<std::uint32_t> kept;  // bits: of Tissue 32 tries each, of Grain the tries of a triangle

    /// Tries each once and notes which are kept. `mesh`: as it is when the test can be made, with the
    /// triangles of the finished one.
    void choose(const geometry::TriangleMesh&, const std::function<bool(const TextureTry&)>& keeps);
    /// Adds the blobs, with the finished mesh. Throws std::runtime_error for more than `left` has room for,
    /// and for numbers that no pattern has.
    void draw(const geometry::TriangleMesh&, std::vector<TextureBlob>&, geometry::Allowance& left) const;
    /// Packs or reads what draw() needs, with the finished mesh.
    void code(geometry::RangeCoder&, const geometry::TriangleMesh&, geometry::Allowance&);

    void state(geometry::StateStream& s) { s(kind, field, seed, numbers, from, to, kept); }
};

/// The texture of a layer: its first blobs one by one, then those of patterns.
struct LayerTexture {
    std::uint64_t singles = 0;
    std::vector<TexturePattern> patterns;
    void state(geometry::StateStream& s) { s(singles, patterns); }
};

/// Bytes of a blob as it is kept.
constexpr std::size_t blob_bytes = 36;

}  // namespace render

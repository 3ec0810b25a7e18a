#pragma once
/// Contrast on the image: which pixels see which piece of vessel, and over what length.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"
#include "render/picture/image.h"
#include "render/xray/c_arm.h"

namespace render {

/// Pixel × centreline node → length of the pixel's ray through the piece of lumen that belongs to the node.
/// Row k is pixel pixels[k], its entries are starts[k] to starts[k + 1], nodes ascending. Pixels ascend;
/// every row has an entry. The pixels listed are those whose rays meet the lumen.
struct ContrastMatrix {
    int width = 0;                      // of the square image [pixels]
    int node_count = 0;                 // columns
    std::vector<std::uint32_t> pixels;  // row by row from the top left
    std::vector<std::uint32_t> starts{0};
    std::vector<std::uint32_t> nodes;
    std::vector<float> lengths;  // mean over the pixel [mm]
    /// Where in its piece an entry's length lies, from the piece's middle in parts of its reach: within the
    /// unit ball, and 0 on average over the image, so that uneven mixing moves iodine and makes none.
    std::vector<Eigen::Vector3f> offsets;
    std::vector<float> reaches;  // of each node's piece [mm]
    int unbalanced_rays = 0;     // rays that entered and left unequally often
};

/// A vertex of a mesh that is displaced.
struct VertexMove {
    std::uint32_t vertex = 0;
    Eigen::Vector3f by = Eigen::Vector3f::Zero();  // [mm]

    bool operator==(const VertexMove& other) const { return vertex == other.vertex && by == other.by; }
    void state(geometry::StateStream& s) { s(vertex, by); }
};

/// A closed lumen cut into pieces: each place belongs to the node whose ball (centre, radius) holds it
/// deepest, by the power distance |x − c|² − r². So a wide vessel keeps its lumen up to the ostium of a
/// narrow branch, and vessels that touch each keep their own.
class LumenContrast {
public:
    /// `nodes` along the centrelines of all vessels, one or two mm apart, each with its inscribed radius
    /// [mm]. Throws std::invalid_argument for no nodes, a different number of radii, radii that are not
    /// positive, numbers that are not finite, or a triangle with a vertex that does not exist.
    LumenContrast(const geometry::TriangleMesh& closed_lumen, std::vector<geometry::Vec3> nodes,
                  const std::vector<float>& radii);
    ~LumenContrast();
    LumenContrast(LumenContrast&&) noexcept;
    LumenContrast& operator=(LumenContrast&&) noexcept;

    std::span<const geometry::Vec3> nodes() const;
    const geometry::TriangleMesh& mesh() const;
    /// The mesh's vertices where the vessels are displaced, each by as much as the node whose piece it is on
    /// [mm].
    std::vector<geometry::Vec3> moved_vertices(std::span<const Eigen::Vector3f> of_nodes) const;
    /// The same lumen, displaced.
    LumenContrast moved(std::span<const Eigen::Vector3f> of_nodes) const;
    /// The same lumen with some vertices displaced, as where a vessel is narrower.
    LumenContrast reshaped(std::span<const VertexMove>) const;

    /// Lengths are means over 2 × 2 rays per pixel; rays that meet the same walls within ½ mm are cut as one.
    /// Where a ray enters and leaves unequally often, as at a hole of the mesh, only chords between an entry
    /// and the exit that directly follows it count. The same arguments give the same bits.
    ContrastMatrix at(const CArm&) const;

private:
    struct Pieces;
    std::unique_ptr<Pieces> pieces_;
};

/// Σ_j L_ij c_j, `iodine` c of each node [mg/ml]; `out` becomes the matrix's size [mg/ml·mm]. Where contrast
/// is unevenly mixed, `streams` gives each node's relative gradient g over the reach of its piece, of length
/// 1 at most: c (1 + g·offset). Empty = well mixed.
void iodine_thickness(const ContrastMatrix&, std::span<const float> iodine, Field& out,
                      std::span<const Eigen::Vector3f> streams = {});

/// For each row of the matrix the label, of those of the nodes, over which the ray runs longest; of equals
/// the lowest. `of_node`: a label for each node.
std::vector<std::uint16_t> longest_label(const ContrastMatrix&, std::span<const std::uint16_t> of_node);

/// How far a node has moved on the image since the matrix was made, to the right and down [pixels], and how
/// that changes around it [pixels/mm].
struct PixelShift {
    float x = 0.0f;
    float y = 0.0f;
    Eigen::Vector3f change_of_x = Eigen::Vector3f::Zero(), change_of_y = Eigen::Vector3f::Zero();
};

/// Shifts of nodes that have moved from `nodes` to `moved`, each by its own depth. They change along a vessel
/// as from one of two nodes, next to each other in list and space, to the other.
std::vector<PixelShift> pixel_shifts(const CArm&, std::span<const geometry::Vec3> nodes,
                                     std::span<const geometry::Vec3> moved);

/// The same for vessels that beat or breathe: the length at a node moves with it, shared among the four
/// pixels around its place in proportion to their overlap; a vessel that is stretched has no gaps. Only what
/// leaves the image is lost.
void iodine_thickness(const ContrastMatrix&, std::span<const float> iodine, std::span<const PixelShift>,
                      Field& out, std::span<const Eigen::Vector3f> streams = {});

}  // namespace render

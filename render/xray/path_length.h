#pragma once
/// How far each pixel's ray runs inside a closed mesh.

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "physics/geometry/vec.h"
#include "render/picture/image.h"
#include "render/xray/c_arm.h"

namespace render {

/// Directed edges that no triangle runs through the other way; 0 means closed: every ray leaves as often as
/// it enters. Corners at the same place are one corner, so that an unindexed mesh can be closed too. Throws
/// std::invalid_argument on a triangle that names a vertex which is not there, or a vertex not finite.
int unmatched_edges(const geometry::TriangleMesh&);

/// A mesh that does not enclose a volume: path lengths inside it would have no meaning.
class OpenMeshError : public std::runtime_error {
public:
    OpenMeshError(const std::string& name, int edges, int pixels);

    const std::string& mesh_name() const { return name_; }
    int edges() const { return edges_; }    // unmatched
    int pixels() const { return pixels_; }  // whose ray enters and leaves unequally often

private:
    std::string name_;
    int edges_ = 0;
    int pixels_ = 0;
};

/// Path lengths of a set of meshes, by adding signed depths of their faces (the L-buffer method: a face that
/// the ray leaves by counts +depth, one that it enters by −depth) in a 32-bit float target. The meshes live
/// in the GL context for the lifetime of the object.
class PathLengthRenderer {
public:
    PathLengthRenderer();  // throws std::runtime_error when GL fails
    ~PathLengthRenderer();
    PathLengthRenderer(const PathLengthRenderer&) = delete;
    PathLengthRenderer& operator=(const PathLengthRenderer&) = delete;

    /// Takes a mesh; the answer names it in `render`.
    int add(const geometry::TriangleMesh&);

    struct Result {
        Field length;               // [mm], arm.pixels squared, along the ray through each pixel's centre
        int unbalanced_pixels = 0;  // whose ray enters and leaves unequally often; their length is 0
    };
    Result render(int mesh, const CArm&);
    /// Adds the lengths to `sum`, of arm.pixels squared; returns the unbalanced pixels.
    int accumulate(int mesh, const CArm&, Field& sum);

private:
    struct Gl;
    std::unique_ptr<Gl> gl_;
};

/// A mesh that encloses some places twice, or is inside out: path lengths there would be counted wrongly.
class OverlappingMeshError : public std::runtime_error {
public:
    OverlappingMeshError(const std::string& name, int pixels, int covered);

    int pixels() const { return pixels_; }  // that see such a place

private:
    int pixels_ = 0;
};

/// Throws OpenMeshError, with the unbalanced pixels of a view of the whole mesh, if the mesh is open.
void require_closed(const std::string& name, const geometry::TriangleMesh&);
/// Throws OverlappingMeshError if of 256 × 256 rays of a view of the whole, closed mesh more than a hundredth
/// of those that meet it meet an overlap.
void require_simple(const std::string& name, const geometry::TriangleMesh&);

}  // namespace render

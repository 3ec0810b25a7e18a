#pragma once
/// The length of each pixel's ray inside a closed mesh.

#include <memory>
#include <span>
#include <stdexcept>
#include <string>

#include "physics/geometry/vec.h"
#include "render/picture/image.h"
#include "render/xray/c_arm.h"

namespace render {

/// Number of directed edges that no triangle runs through in the opposite direction; 0 means closed: every
/// ray leaves as often as it enters. Corners at the same place count as one, so that an unindexed mesh can be
/// closed too. Throws std::invalid_argument for a triangle with a vertex that does not exist, or a vertex
/// that is not finite.
int unmatched_edges(const geometry::TriangleMesh&);

/// A mesh that does not enclose a volume: path lengths inside it would have no meaning.
class OpenMeshError : public std::runtime_error {
public:
    OpenMeshError(const std::string& name, int edges, int pixels);

    int edges() const { return edges_; }    // unmatched
    int pixels() const { return pixels_; }  // pixels whose ray enters and leaves unequally often

private:
    int edges_ = 0;
    int pixels_ = 0;
};

/// What draws path lengths. Their images differ at silhouettes alone, by less than a snapped corner.
enum class Rasteriser { OpenGl, Processor };
/// OpenGL where it adds floats, and elsewhere the processor: in browsers alone.
Rasteriser usual_rasteriser();

/// Path lengths in a set of meshes, by adding signed depths of their faces (the L-buffer method: a face where
/// the ray leaves counts +depth, one where it enters −depth) in 32-bit floats. The meshes stay with the
/// rasteriser for the lifetime of the object. Threads may call at the same time; they draw one after the
/// other.
class PathLengthRenderer {
public:
    explicit PathLengthRenderer(Rasteriser = usual_rasteriser());
    ~PathLengthRenderer();
    PathLengthRenderer(const PathLengthRenderer&) = delete;
    PathLengthRenderer& operator=(const PathLengthRenderer&) = delete;

    /// Adds a mesh, whose triangles name vertices that exist; the returned number identifies it in `render`.
    /// Throws std::runtime_error when OpenGL fails.
    int add(const geometry::TriangleMesh&);
    /// Its vertices may be displaced: by `breath`, `beat` and `drift`, each one for every vertex or none
    /// [mm].
    int add(const geometry::TriangleMesh&, std::span<const Eigen::Vector3f> breath,
            std::span<const Eigen::Vector3f> beat, std::span<const Eigen::Vector3f> drift = {});
    /// Moves the vertices of a mesh that has no displacements. Throws std::invalid_argument for another
    /// number of them.
    void move(int mesh, const geometry::TriangleMesh& moved);
    /// Fractions of these displacements, 0 to 1.
    struct Phase {
        double breath = 0.0, beat = 0.0, drift = 0.0;
    };

    struct Result {
        Field length;               // [mm], arm.pixels squared, along the ray through each pixel's centre
        int unbalanced_pixels = 0;  // pixels whose ray enters and leaves unequally often; their length is 0
    };
    Result render(int mesh, const CArm&, Phase);
    Result render(int mesh, const CArm& arm) { return render(mesh, arm, {}); }
    /// Adds the lengths through all these meshes to `sum`, arm.pixels squared, and their parts nearer to the
    /// source than the isocentre to `before`, unless it is null; returns the number of unbalanced pixels,
    /// which get none of them.
    int accumulate(std::span<const int> meshes, const CArm&, Field& sum, Phase, Field* before);
    int accumulate(int mesh, const CArm& arm, Field& sum, Phase phase) {
        return accumulate({&mesh, 1}, arm, sum, phase, nullptr);
    }
    int accumulate(int mesh, const CArm& arm, Field& sum) { return accumulate(mesh, arm, sum, {}); }

private:
    struct State;
    State& state();
    Rasteriser rasteriser_;
    std::unique_ptr<State> state_;  // made for the first mesh
};

/// A mesh that encloses some places twice, or is inside out: path lengths there would be counted wrongly.
class OverlappingMeshError : public std::runtime_error {
public:
    OverlappingMeshError(const std::string& name, int pixels, int covered);

    int pixels() const { return pixels_; }  // pixels that see such a place

private:
    int pixels_ = 0;
};

/// Throws OpenMeshError, with the unbalanced pixels of a view of the whole mesh, if the mesh is open.
void require_closed(const std::string& name, const geometry::TriangleMesh&);
/// Throws OverlappingMeshError if, of 256 × 256 rays of a view of the whole, closed mesh, more than a
/// hundredth of those that meet the mesh meet an overlap.
void require_simple(const std::string& name, const geometry::TriangleMesh&);

}  // namespace render

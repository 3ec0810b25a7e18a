#pragma once
/// The length of a few rays inside closed meshes, on the processor: what exposure control needs to know of a
/// patient, without images and without OpenGL.

#include <array>
#include <vector>

#include "physics/geometry/vec.h"
#include "render/picture/image.h"
#include "render/xray/c_arm.h"

namespace render {

/// Meshes, cut by the rays to the pixel centres of a coarse image. The result depends on the arguments alone.
class CoarseLengths {
public:
    /// Keeps a copy of the mesh in single precision; returns its number. Throws std::invalid_argument for a
    /// triangle with a vertex that does not exist.
    int add(const geometry::TriangleMesh&);

    /// Adds the length of each pixel's ray inside the mesh to `sum` [mm], arm.pixels squared. A ray that
    /// enters and leaves unequally often, as where the mesh reaches behind the source, adds nothing.
    void accumulate(int mesh, const CArm&, Field& sum) const;

private:
    struct Mesh {
        std::vector<std::array<float, 3>> vertices;
        std::vector<std::array<int, 3>> triangles;
    };
    std::vector<Mesh> meshes_;
};

}  // namespace render

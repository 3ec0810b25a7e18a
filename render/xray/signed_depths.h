#pragma once
/// Sums of signed depths of meshes' faces, which path_length.cpp makes lengths of. For source files of this
/// folder only.

#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>

#include "render/xray/c_arm.h"
#include "render/xray/path_length.h"

namespace render {

/// Part of an image [pixels].
struct Window {
    int left, top, right, bottom;  // the last two exclusive
    bool empty() const { return left >= right || top >= bottom; }
    int width() const { return right - left; }
    int height() const { return bottom - top; }
};

/// Draws meshes that it keeps. Each face whose triangle holds a pixel's centre counts there: its depth from
/// the isocentre's plane [mm], + where the ray leaves and − where it enters; the part of that depth before
/// the plane, with the same sign; and as many of +1 and −1. Corners are snapped to 1/256 pixel, so that
/// triangles with a common edge share no pixel and leave none out.
class SignedDepths {
public:
    /// Displacements by breath, beat and drift, each one for every vertex or none [mm].
    using Moves = std::array<std::span<const Eigen::Vector3f>, 3>;

    virtual ~SignedDepths() = default;
    /// Meshes are numbered from 0. Vertices of triangles exist.
    virtual void add(const TriangleMesh&, const Moves&) = 0;
    /// Other places of all vertices of a mesh without displacements.
    virtual void move(int mesh, const TriangleMesh& moved) = 0;
    /// Four floats for each pixel of the window, by rows from the top: all, before the plane, count and 0.
    /// They stay until the next call.
    virtual std::span<const float> draw(std::span<const int> meshes, const CArm&, PathLengthRenderer::Phase,
                                        const Window&) = 0;
};

/// By a shader with additive blending into floats. Throws std::runtime_error when there is no context.
std::unique_ptr<SignedDepths> signed_depths_by_opengl();
/// In plain C++, one pixel after another: where OpenGL cannot add floats. The same bits everywhere.
std::unique_ptr<SignedDepths> signed_depths_by_processor();

}  // namespace render

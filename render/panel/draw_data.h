#pragma once
/// Draws Dear ImGui's draw data off screen.

#include <memory>

#include "render/picture/image.h"

struct ImDrawData;

namespace render {

/// A backend of Dear ImGui for the off-screen context: textured triangles, alpha blending, scissors. Debian
/// ships the source of a backend only with the documentation, which slim systems omit, and the compiled one
/// finds no OpenGL under OSMesa. To be used by one thread at a time.
class DrawDataRenderer {
public:
    /// A target of width × height pixels. Throws std::runtime_error when GL fails.
    DrawDataRenderer(int width, int height);
    ~DrawDataRenderer();
    DrawDataRenderer(const DrawDataRenderer&) = delete;
    DrawDataRenderer& operator=(const DrawDataRenderer&) = delete;

    /// Textures are identified by a number, which is used as their ImTextureID. Coverage multiplies the alpha
    /// of what is drawn with it; width·height values, 255 opaque.
    void set_coverage(int texture, const GrayImage&);
    /// Opaque grey levels, not interpolated: OpenGL leaves the precision of interpolation to the machine.
    void set_grey(int texture, const GrayImage&);

    /// Draws on black. The colours of the draw data are taken as 8-bit levels of the result.
    ColourImage draw(const ImDrawData&);

private:
    struct Gl;
    std::unique_ptr<Gl> gl_;
};

}  // namespace render

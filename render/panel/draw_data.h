#pragma once
/// What Dear ImGui wants drawn, drawn off screen.

#include <memory>

#include "render/picture/image.h"

struct ImDrawData;

namespace render {

/// A backend of Dear ImGui for the off-screen context: textured triangles, alpha blending, scissors.
/// Debian ships a backend's source only among documentation, which slim systems leave out, and the compiled
/// one finds no OpenGL under OSMesa. To be used by one thread at a time.
class DrawDataRenderer {
public:
    /// A target of width × height pixels. Throws std::runtime_error when GL fails.
    DrawDataRenderer(int width, int height);
    ~DrawDataRenderer();
    DrawDataRenderer(const DrawDataRenderer&) = delete;
    DrawDataRenderer& operator=(const DrawDataRenderer&) = delete;

    /// Textures are known by a number, which stands for them as ImTextureID.
    /// Coverage multiplies the alpha of what is drawn with it; width·height values, 255 opaque.
    void set_coverage(int texture, const GrayImage&);
    /// Opaque grey levels, not interpolated: OpenGL leaves the precision of that to the machine.
    void set_grey(int texture, const GrayImage&);

    /// On black. The colours of the draw data are taken as 8-bit levels of the result.
    ColourImage draw(const ImDrawData&);

private:
    struct Gl;
    std::unique_ptr<Gl> gl_;
};

}  // namespace render

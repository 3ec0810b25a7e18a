#include "render/panel/draw_data.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <imgui.h>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "render/picture/gl_context.h"

namespace render {

namespace {

// The top row is drawn first, and so also read back first.
constexpr const char* panel_vertex_shader = R"(#version 330 core
layout(location = 0) in vec2 position;
layout(location = 1) in vec2 place;
layout(location = 2) in vec4 colour;
uniform vec2 size;
out vec2 texture_place;
out vec4 ink;
void main() {
    texture_place = place;
    ink = colour;
    gl_Position = vec4(2.0 * position / size - 1.0, 0.0, 1.0);
})";

constexpr const char* panel_fragment_shader = R"(#version 330 core
uniform sampler2D picture;
in vec2 texture_place;
in vec4 ink;
out vec4 colour;
void main() { colour = ink * texture(picture, texture_place); })";

}  // namespace

struct DrawDataRenderer::Gl : GlContext {
    struct Texture {
        GLuint name = 0;
        int width = 0;
        int height = 0;
        bool opaque = false;
    };

    int width = 0, height = 0;  // of the target [pixels]
    GLuint program = 0, array = 0, vertices = 0, indices = 0, framebuffer = 0, target = 0;
    std::map<int, Texture> textures;
    std::vector<std::uint8_t> readback;  // red, green, blue, alpha

    Gl(int columns, int rows) : width(columns), height(rows) {
        const auto use = context.use();
        make_program();
        make_target();
        make_buffers();
        require_no_error("making ready for a panel");
        readback.resize(static_cast<std::size_t>(width) * height * 4);
    }

    ~Gl() {
        try {
            const auto use = context.use();
            for (const auto& [number, texture] : textures) DeleteTextures(1, &texture.name);
            DeleteTextures(1, &target);
            DeleteFramebuffers(1, &framebuffer);
            DeleteVertexArrays(1, &array);
            DeleteBuffers(1, &vertices);
            DeleteBuffers(1, &indices);
            DeleteProgram(program);
        } catch (const std::exception&) {
            // The end of the context frees its contents.
        }
    }

    void make_program() {
        program = linked_program(panel_vertex_shader, panel_fragment_shader, "the panel");
        UseProgram(program);
        Uniform2f(GetUniformLocation(program, "size"), float(width), float(height));
    }

    void make_target() {
        GenTextures(1, &target);
        BindTexture(GL_TEXTURE_2D, target);
        TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
        TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        GenFramebuffers(1, &framebuffer);
        BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, target, 0);
        if (CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
            throw std::runtime_error("OpenGL gives no target of " + std::to_string(width) + "x" +
                                     std::to_string(height) + " pixels");
        }
    }

    void make_buffers() {
        GenVertexArrays(1, &array);
        BindVertexArray(array);
        GenBuffers(1, &vertices);
        GenBuffers(1, &indices);
        BindBuffer(GL_ARRAY_BUFFER, vertices);
        BindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices);
        const auto attribute = [this](GLuint at, GLint count, GLenum kind, GLboolean unit,
                                      std::size_t offset) {
            EnableVertexAttribArray(at);
            VertexAttribPointer(at, count, kind, unit, sizeof(ImDrawVert), reinterpret_cast<void*>(offset));
        };
        attribute(0, 2, GL_FLOAT, GL_FALSE, offsetof(ImDrawVert, pos));
        attribute(1, 2, GL_FLOAT, GL_FALSE, offsetof(ImDrawVert, uv));
        attribute(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, offsetof(ImDrawVert, col));
    }

    /// One byte per pixel; `swizzle` defines the channels that it stands for.
    void set_texture(int number, const GrayImage& image, const GLint (&swizzle)[4], GLint filter) {
        const auto use = context.use();
        Texture& texture = textures[number];
        if (texture.name == 0) GenTextures(1, &texture.name);
        BindTexture(GL_TEXTURE_2D, texture.name);
        PixelStorei(GL_UNPACK_ALIGNMENT, 1);
        if (texture.width != image.width || texture.height != image.height) {
            TexImage2D(GL_TEXTURE_2D, 0, GL_R8, image.width, image.height, 0, GL_RED, GL_UNSIGNED_BYTE,
                       image.pixels.data());
            texture.width = image.width;
            texture.height = image.height;
        } else {
            TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, image.width, image.height, GL_RED, GL_UNSIGNED_BYTE,
                          image.pixels.data());
        }
        texture.opaque = swizzle[3] == GL_ONE;
        TexParameteriv(GL_TEXTURE_2D, GL_TEXTURE_SWIZZLE_RGBA, swizzle);
        for (GLenum which : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) {
            TexParameteri(GL_TEXTURE_2D, which, filter);
        }
        for (GLenum which : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T}) {
            TexParameteri(GL_TEXTURE_2D, which, GL_CLAMP_TO_EDGE);
        }
        require_no_error("loading a picture of the panel");
    }

    /// In a use of the context, as draw_list() and read().
    void begin() {
        BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        Viewport(0, 0, width, height);
        for (GLenum off : {GL_DEPTH_TEST, GL_CULL_FACE, GL_DITHER, GL_MULTISAMPLE, GL_SCISSOR_TEST}) {
            Disable(off);
        }
        ClearColor(0.0f, 0.0f, 0.0f, 1.0f);
        Clear(GL_COLOR_BUFFER_BIT);
        Enable(GL_SCISSOR_TEST);
        BlendEquation(GL_FUNC_ADD);
        BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
        UseProgram(program);
        BindVertexArray(array);
        BindBuffer(GL_ARRAY_BUFFER, vertices);
    }

    void draw_list(const ImDrawList& list) {
        const auto bytes = [](const auto& items) { return static_cast<GLsizeiptr>(items.size_in_bytes()); };
        BufferData(GL_ARRAY_BUFFER, bytes(list.VtxBuffer), list.VtxBuffer.Data, GL_STREAM_DRAW);
        BufferData(GL_ELEMENT_ARRAY_BUFFER, bytes(list.IdxBuffer), list.IdxBuffer.Data, GL_STREAM_DRAW);
        for (const ImDrawCmd& command : list.CmdBuffer) {
            const auto texture =
                textures.find(static_cast<int>(reinterpret_cast<std::intptr_t>(command.TextureId)));
            const int left = std::max(0, static_cast<int>(command.ClipRect.x)),
                      top = std::max(0, static_cast<int>(command.ClipRect.y)),
                      right = std::min(width, static_cast<int>(command.ClipRect.z)),
                      bottom = std::min(height, static_cast<int>(command.ClipRect.w));
            if (texture == textures.end() || right <= left || bottom <= top) continue;
            Scissor(left, top, right - left, bottom - top);
            BindTexture(GL_TEXTURE_2D, texture->second.name);
            if (texture->second.opaque) {
                Disable(GL_BLEND);  // saves a tenth of a panel's time
            } else {
                Enable(GL_BLEND);
            }
            DrawElementsBaseVertex(GL_TRIANGLES, static_cast<GLsizei>(command.ElemCount),
                                   sizeof(ImDrawIdx) == 2 ? GL_UNSIGNED_SHORT : GL_UNSIGNED_INT,
                                   reinterpret_cast<void*>(command.IdxOffset * sizeof(ImDrawIdx)),
                                   static_cast<GLint>(command.VtxOffset));
        }
    }

    ColourImage read() {
        PixelStorei(GL_PACK_ALIGNMENT, 4);
        ReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, readback.data());
        require_no_error("drawing the panel");
        ColourImage image{width, height, std::vector<std::uint8_t>(readback.size() / 4 * 3)};
        const std::uint8_t* from = readback.data();
        for (std::uint8_t *to = image.pixels.data(), *end = to + image.pixels.size(); to != end;
             to += 3, from += 4) {
            to[0] = from[0];
            to[1] = from[1];
            to[2] = from[2];
        }
        return image;
    }
};

DrawDataRenderer::DrawDataRenderer(int width, int height) : gl_(std::make_unique<Gl>(width, height)) {}
DrawDataRenderer::~DrawDataRenderer() = default;

void DrawDataRenderer::set_coverage(int texture, const GrayImage& image) {
    gl_->set_texture(texture, image, {GL_ONE, GL_ONE, GL_ONE, GL_RED}, GL_LINEAR);
}

void DrawDataRenderer::set_grey(int texture, const GrayImage& image) {
    gl_->set_texture(texture, image, {GL_RED, GL_RED, GL_RED, GL_ONE}, GL_NEAREST);
}

ColourImage DrawDataRenderer::draw(const ImDrawData& data) {
    const auto use = gl_->context.use();
    gl_->begin();
    for (int n = 0; n < data.CmdListsCount; ++n) gl_->draw_list(*data.CmdLists[n]);
    return gl_->read();
}

}  // namespace render

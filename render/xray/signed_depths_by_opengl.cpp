#include <algorithm>
#include <glm/gtc/type_ptr.hpp>
#include <utility>
#include <vector>

#include "render/picture/gl_context.h"
#include "render/xray/gl_camera.h"
#include "render/xray/signed_depths.h"

namespace render {
namespace {

// Depth is relative to the isocentre plane, which preserves digits in the float target and limits the harm of
// a hole. The row nearest to the head is written first, so that readback is already top-down.
constexpr const char* vertex_shader = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 breath;  // 0 where a mesh has none
layout(location = 2) in vec3 beat;
layout(location = 3) in vec3 drift;
uniform vec3 isocentre, phase;
uniform mat4 view, projection;
out float depth;
flat out float corner;
void main() {
    vec3 moved = position + phase.x * breath + phase.y * beat + phase.z * drift;
    vec3 turned = mat3(view) * (moved - isocentre);
    depth = -turned.z;
    corner = depth;
    gl_Position = projection * vec4(turned + view[3].xyz, 1.0);
})";

// In a triangle seen edge-on rounding can carry the interpolated depth far away; none of it is farther from a
// corner than its longest edge.
constexpr const char* fragment_shader = R"(
in float depth;
flat in float corner;
uniform float longest_edge;
out vec4 lengths_and_count;  // all of the ray, its part before the isocentre's plane
void main() {
    float there = clamp(depth, corner - longest_edge, corner + longest_edge);
    vec4 leaving = vec4(there, min(there, 0.0), -1.0, 0.0);
    lengths_and_count = gl_FrontFacing ? -leaving : leaving;
})";

/// Those of vertices, one after another.
std::vector<float> in_floats(const std::vector<Vec3>& vertices) {
    std::vector<float> floats;
    floats.reserve(vertices.size() * 3);
    for (const Vec3& v : vertices)
        for (int k = 0; k < 3; ++k) floats.push_back(static_cast<float>(v[k]));
    return floats;
}

/// As long as an edge can be at any phase, and a little more for rounding [mm].
float longest_edge(const TriangleMesh& mesh, const SignedDepths::Moves& moves) {
    double longest = 0.0;
    for (const auto& t : mesh.triangles)
        for (int k = 0; k < 3; ++k) {
            const int a = t[k], b = t[(k + 1) % 3];
            double length = (mesh.vertices[a] - mesh.vertices[b]).norm();
            for (const auto& move : moves)
                if (!move.empty()) length += static_cast<double>((move[a] - move[b]).norm());
            longest = std::max(longest, length);
        }
    return static_cast<float>(1.001 * longest + 1e-3);
}

class ByOpenGl : public SignedDepths {
public:
    ByOpenGl() {
        const auto use = gl_.context.use();
        program_ = gl_.linked_program(vertex_shader, fragment_shader, "the path length");
    }
    ~ByOpenGl() override {
        try {
            const auto use = gl_.context.use();
            for (const Mesh& mesh : meshes_) {
                gl_.DeleteVertexArrays(1, &mesh.array);
                gl_.DeleteBuffers(1, &mesh.vertices);
                gl_.DeleteBuffers(1, &mesh.indices);
                gl_.DeleteBuffers(3, mesh.moves);
            }
            gl_.DeleteFramebuffers(1, &framebuffer_);
            gl_.DeleteTextures(1, &texture_);
            gl_.DeleteProgram(program_);
        } catch (const std::exception&) {
            // The end of the context frees its contents.
        }
    }
    ByOpenGl(const ByOpenGl&) = delete;
    ByOpenGl& operator=(const ByOpenGl&) = delete;

    void add(const TriangleMesh& mesh, const Moves& moves) override {
        const auto use = gl_.context.use();
        const std::vector<float> positions = in_floats(mesh.vertices);
        std::vector<GLuint> indices;
        indices.reserve(mesh.triangles.size() * 3);
        for (const auto& triangle : mesh.triangles)
            for (int corner : triangle) indices.push_back(static_cast<GLuint>(corner));
        Mesh made;
        made.longest_edge = longest_edge(mesh, moves);
        made.count = static_cast<GLsizei>(indices.size());
        gl_.GenVertexArrays(1, &made.array);
        gl_.BindVertexArray(made.array);
        const auto load = [&](GLenum target, GLuint& buffer, std::size_t bytes, const void* data) {
            gl_.GenBuffers(1, &buffer);
            gl_.BindBuffer(target, buffer);
            gl_.BufferData(target, static_cast<GLsizeiptr>(bytes), data, GL_STATIC_DRAW);
        };
        const auto attribute = [&](GLuint index, GLuint& buffer, std::size_t bytes, const void* data) {
            load(GL_ARRAY_BUFFER, buffer, bytes, data);
            gl_.EnableVertexAttribArray(index);
            gl_.VertexAttribPointer(index, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
        };
        attribute(0, made.vertices, positions.size() * sizeof(float), positions.data());
        for (GLuint k = 0; k < moves.size(); ++k)
            if (!moves[k].empty()) attribute(1 + k, made.moves[k], moves[k].size_bytes(), moves[k].data());
        load(GL_ELEMENT_ARRAY_BUFFER, made.indices, indices.size() * sizeof(GLuint), indices.data());
        gl_.BindVertexArray(0);
        meshes_.push_back(made);
        gl_.require_no_error("loading a mesh");
    }

    void move(int mesh, const TriangleMesh& moved) override {
        const auto use = gl_.context.use();
        Mesh& known = meshes_.at(static_cast<std::size_t>(mesh));
        const std::vector<float> positions = in_floats(moved.vertices);
        known.longest_edge = std::max(known.longest_edge, longest_edge(moved, {}));
        gl_.BindBuffer(GL_ARRAY_BUFFER, known.vertices);
        gl_.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(positions.size() * sizeof(float)),
                       positions.data(), GL_STATIC_DRAW);
        gl_.require_no_error("moving a mesh");
    }

    std::span<const float> draw(std::span<const int> meshes, const CArm& arm, PathLengthRenderer::Phase phase,
                                const Window& window) override {
        const auto use = gl_.context.use();
        resize(arm.pixels);
        gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
        gl_.Viewport(0, 0, arm.pixels, arm.pixels);
        for (GLenum off : {GL_DEPTH_TEST, GL_CULL_FACE, GL_DITHER, GL_MULTISAMPLE}) gl_.Disable(off);
        // The row nearest to the head is the first of the target.
        gl_.Enable(GL_SCISSOR_TEST);
        gl_.Scissor(window.left, window.top, window.width(), window.height());
        gl_.Enable(GL_BLEND);
        gl_.BlendEquation(GL_FUNC_ADD);
        gl_.BlendFunc(GL_ONE, GL_ONE);
        gl_.ClearColor(0.0f, 0.0f, 0.0f, 0.0f);
        gl_.Clear(GL_COLOR_BUFFER_BIT);

        gl_.UseProgram(program_);
        uniform("isocentre", arm.isocentre);
        uniform("phase", Vec3(phase.breath, phase.beat, phase.drift));
        uniform("view", glm::mat4(view_matrix(arm)));
        uniform("projection", glm::mat4(projection_matrix(arm)));
        for (const int mesh : meshes) {
            const Mesh& drawn = meshes_.at(static_cast<std::size_t>(mesh));
            gl_.Uniform1f(gl_.GetUniformLocation(program_, "longest_edge"), drawn.longest_edge);
            gl_.BindVertexArray(drawn.array);
            gl_.DrawElements(GL_TRIANGLES, drawn.count, GL_UNSIGNED_INT, nullptr);
        }
        gl_.BindVertexArray(0);
        gl_.PixelStorei(GL_PACK_ALIGNMENT, 4);
        gl_.ReadPixels(window.left, window.top, window.width(), window.height(), GL_RGBA, GL_FLOAT,
                       readback_.data());
        gl_.require_no_error("drawing path lengths");
        return readback_;
    }

private:
    struct Mesh {
        GLuint array = 0, vertices = 0, indices = 0, moves[3] = {0, 0, 0};
        GLsizei count = 0;
        float longest_edge = 0.0f;  // [mm]
    };

    void resize(int pixels) {
        if (size_ == pixels) return;
        if (framebuffer_ == 0) {
            gl_.GenFramebuffers(1, &framebuffer_);
            gl_.GenTextures(1, &texture_);
        }
        gl_.BindTexture(GL_TEXTURE_2D, texture_);
        gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, pixels, pixels, 0, GL_RGBA, GL_FLOAT, nullptr);
        gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
        gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_, 0);
        if (gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
            throw std::runtime_error("OpenGL gives no 32-bit float target of " + std::to_string(pixels) +
                                     " pixels along a side");
        }
        size_ = pixels;
        readback_.resize(static_cast<std::size_t>(pixels) * pixels * 4);
    }
    void uniform(const char* name, const Vec3& v) {
        gl_.Uniform3f(gl_.GetUniformLocation(program_, name), float(v.x()), float(v.y()), float(v.z()));
    }
    void uniform(const char* name, const glm::mat4& m) {
        gl_.UniformMatrix4fv(gl_.GetUniformLocation(program_, name), 1, GL_FALSE, glm::value_ptr(m));
    }

    GlContext gl_;
    std::vector<Mesh> meshes_;
    GLuint program_ = 0, framebuffer_ = 0, texture_ = 0;
    int size_ = 0;                 // of the target, pixels along a side
    std::vector<float> readback_;  // as draw() gives them
};

}  // namespace

std::unique_ptr<SignedDepths> signed_depths_by_opengl() {
    return std::make_unique<ByOpenGl>();
}

}  // namespace render

#include "render/xray/path_length.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "physics/geometry/mesh_topology.h"
#include "render/picture/gl_context.h"
#include "render/xray/gl_camera.h"
#include "render/xray/surface_crossings.h"

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

}  // namespace

int unmatched_edges(const TriangleMesh& mesh) {
    const int count = static_cast<int>(mesh.vertices.size());
    for (int i = 0; i < count; ++i)
        if (!mesh.vertices[i].allFinite())
            throw std::invalid_argument("vertex " + std::to_string(i) + " is not finite");
    const std::vector<int> corner = geometry::first_at_place(mesh.vertices);
    // Edges by their lower corner, which few of them share. An edge that is run through equally often in both
    // directions is matched.
    std::vector<std::size_t> starts(mesh.vertices.size() + 1, 0);
    const auto for_each_edge = [&](const auto& use) {
        for (const auto& triangle : mesh.triangles) {
            for (int k = 0; k < 3; ++k) {
                const int a = corner[triangle[k]], b = corner[triangle[(k + 1) % 3]];
                if (a != b) use(std::min(a, b), std::max(a, b), a < b ? 1 : -1);
            }
        }
    };
    for (const auto& triangle : mesh.triangles) {
        for (const int v : triangle) {
            if (v >= 0 && v < count) continue;
            throw std::invalid_argument("a triangle names vertex " + std::to_string(v) + " of " +
                                        std::to_string(count));
        }
    }
    for_each_edge([&](int low, int, int) { ++starts[low + 1]; });
    for (int i = 0; i < count; ++i) starts[i + 1] += starts[i];
    struct HalfEdge {
        int other, forward;
    };
    std::vector<HalfEdge> half_edges(starts.back());
    std::vector<std::size_t> next(starts.begin(), starts.end() - 1);
    for_each_edge([&](int low, int high, int forward) { half_edges[next[low]++] = {high, forward}; });
    int unmatched = 0;
    for (int i = 0; i < count; ++i) {
        const auto own = std::span(half_edges).subspan(starts[i], starts[i + 1] - starts[i]);
        std::sort(own.begin(), own.end(),
                  [](const HalfEdge& a, const HalfEdge& b) { return a.other < b.other; });
        for (std::size_t k = 0; k < own.size();) {
            const int other = own[k].other;
            int sum = 0;
            for (; k < own.size() && own[k].other == other; ++k) sum += own[k].forward;
            unmatched += std::abs(sum);
        }
    }
    return unmatched;
}

OpenMeshError::OpenMeshError(const std::string& name, int edges, int pixels)
    : std::runtime_error("the mesh '" + name + "' is open: " + std::to_string(edges) + " unmatched edges, " +
                         std::to_string(pixels) +
                         " pixels whose ray enters and leaves unequally often; close it first"),
      edges_(edges),
      pixels_(pixels) {}

struct PathLengthRenderer::Gl : GlContext {
    struct Mesh {
        GLuint array = 0, vertices = 0, indices = 0, moves[3] = {0, 0, 0};
        GLsizei count = 0;
        std::size_t vertex_count = 0;
        Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // of the box around it [mm]
        float longest_edge = 0.0f;                     // [mm]
    };

    std::mutex mutex;  // of one call at a time
    std::vector<Mesh> meshes;
    GLuint program = 0, framebuffer = 0, texture = 0;
    int size = 0;                 // of the target, pixels along a side
    std::vector<float> readback;  // lengths, count and nothing, interleaved

    Gl() {
        const auto use = context.use();
        program = linked_program(vertex_shader, fragment_shader, "the path length");
    }

    ~Gl() {
        try {
            const auto use = context.use();
            for (const Mesh& mesh : meshes) {
                DeleteVertexArrays(1, &mesh.array);
                DeleteBuffers(1, &mesh.vertices);
                DeleteBuffers(1, &mesh.indices);
                DeleteBuffers(3, mesh.moves);
            }
            DeleteFramebuffers(1, &framebuffer);
            DeleteTextures(1, &texture);
            DeleteProgram(program);
        } catch (const std::exception&) {
            // The end of the context frees its contents.
        }
    }

    void resize(int pixels) {
        if (size == pixels) return;
        if (framebuffer == 0) {
            GenFramebuffers(1, &framebuffer);
            GenTextures(1, &texture);
        }
        BindTexture(GL_TEXTURE_2D, texture);
        TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, pixels, pixels, 0, GL_RGBA, GL_FLOAT, nullptr);
        TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
        if (CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
            throw std::runtime_error("OpenGL gives no 32-bit float target of " + std::to_string(pixels) +
                                     " pixels along a side");
        }
        size = pixels;
        readback.resize(static_cast<std::size_t>(pixels) * pixels * 4);
    }

    void uniform(const char* name, const Vec3& v) {
        Uniform3f(GetUniformLocation(program, name), float(v.x()), float(v.y()), float(v.z()));
    }
    void uniform(const char* name, const glm::mat4& m) {
        UniformMatrix4fv(GetUniformLocation(program, name), 1, GL_FALSE, glm::value_ptr(m));
    }
};

PathLengthRenderer::Gl& PathLengthRenderer::gl() {
    if (!gl_) gl_ = std::make_unique<Gl>();
    return *gl_;
}

PathLengthRenderer::PathLengthRenderer() = default;
PathLengthRenderer::~PathLengthRenderer() = default;

int PathLengthRenderer::add(const TriangleMesh& mesh) {
    return add(mesh, {}, {});
}

int PathLengthRenderer::add(const TriangleMesh& mesh, std::span<const Eigen::Vector3f> breath,
                            std::span<const Eigen::Vector3f> beat, std::span<const Eigen::Vector3f> drift) {
    for (const auto& moves : {breath, beat, drift}) {
        if (!moves.empty() && moves.size() != mesh.vertices.size())
            throw std::invalid_argument(std::to_string(mesh.vertices.size()) + " vertices have " +
                                        std::to_string(moves.size()) + " displacements");
    }
    Gl& gl = this->gl();
    const std::lock_guard lock(gl.mutex);
    const auto use = gl.context.use();
    std::vector<float> positions;
    positions.reserve(mesh.vertices.size() * 3);
    Gl::Mesh made;
    if (!mesh.vertices.empty()) made.low = made.high = mesh.vertices.front();
    for (const Vec3& v : mesh.vertices) {
        made.low = made.low.cwiseMin(v);
        made.high = made.high.cwiseMax(v);
        for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(v[k]));
    }
    // The box holds the mesh at every phase.
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        for (const auto& moves : {breath, beat, drift}) {
            if (moves.empty()) continue;
            const Vec3 reach = moves[i].cast<double>().cwiseAbs();
            made.low = made.low.cwiseMin(mesh.vertices[i] - 3.0 * reach);
            made.high = made.high.cwiseMax(mesh.vertices[i] + 3.0 * reach);
        }
    }
    // As long as an edge can be at any phase, and a little more for rounding.
    double longest = 0.0;
    for (const auto& t : mesh.triangles)
        for (int k = 0; k < 3; ++k) {
            const int a = t[k], b = t[(k + 1) % 3];
            double length = (mesh.vertices[a] - mesh.vertices[b]).norm();
            for (const auto& moves : {breath, beat, drift})
                if (!moves.empty()) length += static_cast<double>((moves[a] - moves[b]).norm());
            longest = std::max(longest, length);
        }
    made.longest_edge = static_cast<float>(1.001 * longest + 1e-3);
    std::vector<GLuint> indices;
    indices.reserve(mesh.triangles.size() * 3);
    for (const auto& triangle : mesh.triangles) {
        for (int corner : triangle) indices.push_back(static_cast<GLuint>(corner));
    }
    made.count = static_cast<GLsizei>(indices.size());
    made.vertex_count = mesh.vertices.size();
    gl.GenVertexArrays(1, &made.array);
    gl.BindVertexArray(made.array);
    gl.GenBuffers(1, &made.vertices);
    gl.BindBuffer(GL_ARRAY_BUFFER, made.vertices);
    gl.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(positions.size() * sizeof(float)),
                  positions.data(), GL_STATIC_DRAW);
    gl.EnableVertexAttribArray(0);
    gl.VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    for (const auto& [index, moves] : {std::pair{0, breath}, std::pair{1, beat}, std::pair{2, drift}}) {
        if (moves.empty()) continue;
        gl.GenBuffers(1, &made.moves[index]);
        gl.BindBuffer(GL_ARRAY_BUFFER, made.moves[index]);
        gl.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(moves.size() * sizeof(Eigen::Vector3f)),
                      moves.data(), GL_STATIC_DRAW);
        gl.EnableVertexAttribArray(1 + index);
        gl.VertexAttribPointer(1 + index, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    }
    gl.GenBuffers(1, &made.indices);
    gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, made.indices);
    gl.BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof(GLuint)),
                  indices.data(), GL_STATIC_DRAW);
    gl.BindVertexArray(0);
    gl.meshes.push_back(made);
    gl.require_no_error("loading a mesh");
    return static_cast<int>(gl.meshes.size()) - 1;
}

void PathLengthRenderer::move(int mesh, const TriangleMesh& moved) {
    Gl& gl = this->gl();
    const std::lock_guard lock(gl.mutex);
    const auto use = gl.context.use();
    Gl::Mesh& known = gl.meshes.at(static_cast<std::size_t>(mesh));
    if (moved.vertices.size() != known.vertex_count || known.moves[0] || known.moves[1] || known.moves[2])
        throw std::invalid_argument(std::to_string(known.vertex_count) + " vertices cannot move to " +
                                    std::to_string(moved.vertices.size()) + " places");
    std::vector<float> positions;
    positions.reserve(moved.vertices.size() * 3);
    for (const Vec3& v : moved.vertices) {
        known.low = known.low.cwiseMin(v);
        known.high = known.high.cwiseMax(v);
        for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(v[k]));
    }
    double longest = 0.0;
    for (const auto& t : moved.triangles)
        for (int k = 0; k < 3; ++k)
            longest = std::max(longest, (moved.vertices[t[k]] - moved.vertices[t[(k + 1) % 3]]).norm());
    known.longest_edge = std::max(known.longest_edge, static_cast<float>(1.001 * longest + 1e-3));
    gl.BindBuffer(GL_ARRAY_BUFFER, known.vertices);
    gl.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(positions.size() * sizeof(float)),
                  positions.data(), GL_STATIC_DRAW);
    gl.require_no_error("moving a mesh");
}

namespace {

/// Part of an image [pixels].
struct Window {
    int left, top, right, bottom;  // the last two exclusive
    bool empty() const { return left >= right || top >= bottom; }
};

/// The window that the image of a box may cover: all of it when the box reaches toward the source's plane.
Window window_of(const Vec3& low, const Vec3& high, const CArm& arm) {
    double left = arm.pixels, top = arm.pixels, right = 0, bottom = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const Pixel at = project(arm, {(corner & 1 ? high : low).x(), (corner & 2 ? high : low).y(),
                                       (corner & 4 ? high : low).z()});
        if (!(at.depth > 1.0)) return {0, 0, arm.pixels, arm.pixels};
        left = std::min(left, at.x);
        top = std::min(top, at.y);
        right = std::max(right, at.x);
        bottom = std::max(bottom, at.y);
    }
    // One pixel more for rounding.
    const auto within = [&arm](double place) {
        return static_cast<int>(std::clamp(place, 0.0, static_cast<double>(arm.pixels)));
    };
    return {within(left - 1), within(top - 1), within(std::ceil(right) + 1), within(std::ceil(bottom) + 1)};
}

}  // namespace

PathLengthRenderer::Result PathLengthRenderer::render(int mesh, const CArm& arm, Phase phase) {
    Result result{Field(arm.pixels, arm.pixels), 0};
    result.unbalanced_pixels = accumulate(mesh, arm, result.length, phase);
    return result;
}

int PathLengthRenderer::accumulate(std::span<const int> meshes, const CArm& arm, Field& sum, Phase phase,
                                   Field* before) {
    Gl& gl = this->gl();
    const std::lock_guard lock(gl.mutex);
    const int pixels = arm.pixels;
    assert(sum.width == pixels && sum.height == pixels);
    Window window{pixels, pixels, 0, 0};
    std::vector<const Gl::Mesh*> seen;
    for (const int mesh : meshes) {
        const Gl::Mesh& drawn = gl.meshes.at(static_cast<std::size_t>(mesh));
        const Window own = window_of(drawn.low, drawn.high, arm);
        if (own.empty()) continue;
        seen.push_back(&drawn);
        window = {std::min(window.left, own.left), std::min(window.top, own.top),
                  std::max(window.right, own.right), std::max(window.bottom, own.bottom)};
    }
    if (seen.empty()) return 0;
    const int width = window.right - window.left, height = window.bottom - window.top;
    const auto use = gl.context.use();
    gl.resize(pixels);
    gl.BindFramebuffer(GL_FRAMEBUFFER, gl.framebuffer);
    gl.Viewport(0, 0, pixels, pixels);
    for (GLenum off : {GL_DEPTH_TEST, GL_CULL_FACE, GL_DITHER, GL_MULTISAMPLE}) gl.Disable(off);
    // The row nearest to the head is the first of the target.
    gl.Enable(GL_SCISSOR_TEST);
    gl.Scissor(window.left, window.top, width, height);
    gl.Enable(GL_BLEND);
    gl.BlendEquation(GL_FUNC_ADD);
    gl.BlendFunc(GL_ONE, GL_ONE);
    gl.ClearColor(0.0f, 0.0f, 0.0f, 0.0f);
    gl.Clear(GL_COLOR_BUFFER_BIT);

    gl.UseProgram(gl.program);
    gl.uniform("isocentre", arm.isocentre);
    gl.uniform("phase", Vec3(phase.breath, phase.beat, phase.drift));
    gl.uniform("view", glm::mat4(view_matrix(arm)));
    gl.uniform("projection", glm::mat4(projection_matrix(arm)));
    for (const Gl::Mesh* drawn : seen) {
        gl.Uniform1f(gl.GetUniformLocation(gl.program, "longest_edge"), drawn->longest_edge);
        gl.BindVertexArray(drawn->array);
        gl.DrawElements(GL_TRIANGLES, drawn->count, GL_UNSIGNED_INT, nullptr);
    }
    gl.BindVertexArray(0);
    gl.PixelStorei(GL_PACK_ALIGNMENT, 4);
    gl.ReadPixels(window.left, window.top, width, height, GL_RGBA, GL_FLOAT, gl.readback.data());
    gl.require_no_error("drawing path lengths");

    int unbalanced = 0;
    const double step = pixel_width(arm) / arm.sid;
    for (int j = window.top; j < window.bottom; ++j) {
        const double y = (j + 0.5 - 0.5 * pixels) * step;
        const float* from = gl.readback.data() + 4 * static_cast<std::size_t>(j - window.top) * width;
        float* to = sum.values.data() + static_cast<std::size_t>(j) * pixels;
        float* to_before = before ? before->values.data() + static_cast<std::size_t>(j) * pixels : nullptr;
        for (int i = window.left; i < window.right; ++i, from += 4) {
            if (from[2] != 0.0f) {
                ++unbalanced;
                continue;
            }
            const double depth = from[0];
            if (!(depth > 0.0)) continue;
            // From depth along the beam axis to length along the ray.
            const double x = (i + 0.5 - 0.5 * pixels) * step;
            const double oblique = std::sqrt(1.0 + x * x + y * y);
            to[i] += static_cast<float>(depth * oblique);
            if (to_before) to_before[i] += static_cast<float>(from[1] * oblique);
        }
    }
    return unbalanced;
}

/// A distant, oblique view that shows the whole mesh: axis-aligned holes would be edge-on from the front.
static CArm view_of(const TriangleMesh& mesh) {
    Vec3 low = mesh.vertices.front(), high = low;
    for (const Vec3& v : mesh.vertices) {
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
    }
    const double radius = std::max(0.5 * (high - low).norm(), 1e-3);
    CArm arm;
    arm.lao = 0.5;
    arm.cranial = 0.4;
    arm.isocentre = 0.5 * (low + high);
    arm.sod = 10.0 * radius;
    arm.sid = 12.0 * radius;
    arm.detector_width = 2.6 * radius;
    return arm;
}

void require_closed(const std::string& name, const TriangleMesh& mesh) {
    int edges = 0;
    try {
        edges = unmatched_edges(mesh);
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error("the mesh '" + name + "' is broken: " + error.what());
    }
    if (edges == 0) return;
    const CArm arm = view_of(mesh);
    PathLengthRenderer renderer;
    throw OpenMeshError(name, edges, renderer.render(renderer.add(mesh), arm).unbalanced_pixels);
}

OverlappingMeshError::OverlappingMeshError(const std::string& name, int pixels, int covered)
    : std::runtime_error(
          "the mesh '" + name + "' overlaps itself or is inside out: " + std::to_string(pixels) + " of the " +
          std::to_string(covered) +
          " pixels that it covers in a view are unbalanced on the way; expected at most one in a hundred"),
      pixels_(pixels) {}

void require_simple(const std::string& name, const TriangleMesh& mesh) {
    CArm arm = view_of(mesh);
    arm.pixels = 256;
    const SurfaceCrossings met = surface_crossings(mesh, arm, 1);
    int wrong = 0, covered = 0;
    for (int v = 0; v < met.side; ++v) {
        for (int u = 0; u < met.side; ++u) {
            int inside = 0;
            bool alternates = true;
            for (const Crossing& crossing : met.of(u, v)) {
                inside += crossing.entry ? 1 : -1;
                alternates = alternates && (inside == 0 || inside == 1);
            }
            wrong += !alternates;
            covered += !met.of(u, v).empty();
        }
    }
    // A few intersecting triangles, as in a surface drawn by hand, do not change any image.
    constexpr double tolerated = 0.01;
    if (wrong > tolerated * covered) throw OverlappingMeshError(name, wrong, covered);
}

}  // namespace render

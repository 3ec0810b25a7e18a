#include "app/play/patient_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <numbers>

#include "engine/io/error.h"

namespace app {
namespace {

constexpr float force_length = 40;  // length of a line that represents 1 N [mm]
constexpr float thicker = 2;        // than they are devices are drawn, to be seen from a distance

struct Vertex {
    glm::vec3 place, normal, tint;
};

const char* const vertex_shader = R"(#version 330 core
layout(location = 0) in vec3 place;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 tint;
uniform mat4 camera;
uniform vec3 shift;
out vec3 world, facing, shade;
void main() {
    world = place + shift;
    facing = normal;
    shade = tint;
    gl_Position = camera * vec4(world, 1.0);
})";

// Lit from the eye; `rim` makes edge-on surfaces more opaque, so that a vessel shows its outline.
const char* const fragment_shader = R"(#version 330 core
in vec3 world, facing, shade;
uniform vec3 eye;
uniform float opacity, rim;
out vec4 colour;
void main() {
    float size = length(facing);
    float slant = size > 0.0 ? abs(dot(facing / size, normalize(eye - world))) : 1.0;
    colour = vec4(shade * (0.55 + 0.45 * slant), clamp(opacity + rim * pow(1.0 - slant, 2.0), 0.0, 1.0));
})";

glm::vec3 single(const geometry::Vec3& v) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

glm::vec3 single(render::Ink ink) {
    return glm::vec3(ink.red, ink.green, ink.blue) / 255.0f;
}

/// Adds two triangles between each side of a ring of vertices and the ring before it. `ring` is the index of
/// its first vertex.
void join_to_last_ring(std::vector<unsigned>& indices, std::size_t ring, unsigned sides) {
    const auto first = static_cast<unsigned>(ring);
    for (unsigned k = 0; k < sides; ++k) {
        const unsigned next = (k + 1) % sides, a = first - sides + k, b = first - sides + next;
        for (const unsigned corner : {a, b, a + sides, b, b + sides, a + sides}) indices.push_back(corner);
    }
}

}  // namespace

render::Ink force_colour(double force) {
    static constexpr std::array<render::Ink, 5> stops = {
        {{107, 115, 204}, {59, 153, 191}, {51, 191, 140}, {153, 217, 77}, {255, 235, 51}}};
    const double part =
        force <= least_force ? 0 : std::log(force / least_force) / std::log(most_force / least_force);
    const double at = std::clamp(part, 0.0, 1.0) * (stops.size() - 1);
    const std::size_t first = std::min<std::size_t>(stops.size() - 2, static_cast<std::size_t>(at));
    const auto mixed = [&](std::uint8_t a, std::uint8_t b) {
        return static_cast<std::uint8_t>(std::lround(std::lerp(a, b, at - static_cast<double>(first))));
    };
    const render::Ink &low = stops[first], &high = stops[first + 1];
    return {mixed(low.red, high.red), mixed(low.green, high.green), mixed(low.blue, high.blue)};
}

struct PatientScene::Content {
    const Gl& gl;
    GLuint program = 0, target = 0, picture = 0, depth = 0;
    GLint camera_at = -1, eye_at = -1, opacity_at = -1, rim_at = -1, shift_at = -1;
    int width = 0, height = 0;
    struct Mesh {
        GLuint array = 0, vertices = 0, indices = 0;
        int count = 0;
    } lumen, wire, forces, goal;
    const void* drawn_lumen = nullptr;
    std::vector<Eigen::Vector3f> drawn_moves;
    long drawn_view = -1;
    bool turned = true;                                    // the camera has moved since the last picture
    float azimuth = 0, elevation = 0.15f, distance = 320;  // of the eye [rad], [mm]

    explicit Content(const Gl& functions) : gl(functions) {}
    ~Content() {
        for (Mesh* mesh : {&lumen, &wire, &forces, &goal}) {
            if (!mesh->array) continue;
            gl.DeleteVertexArrays(1, &mesh->array);
            gl.DeleteBuffers(1, &mesh->vertices);
            gl.DeleteBuffers(1, &mesh->indices);
        }
        if (program) gl.DeleteProgram(program);
        free_target();
    }

    void free_target() {
        if (!target) return;
        gl.DeleteFramebuffers(1, &target);
        gl.DeleteTextures(1, &picture);
        gl.DeleteRenderbuffers(1, &depth);
        target = 0;
    }

    GLuint shader(GLenum kind, const char* text) const {
        const GLuint made = gl.CreateShader(kind);
        gl.ShaderSource(made, 1, &text, nullptr);
        gl.CompileShader(made);
        GLint good = 0;
        gl.GetShaderiv(made, GL_COMPILE_STATUS, &good);
        if (!good) {
            char log[512] = "";
            gl.GetShaderInfoLog(made, sizeof log, nullptr, log);
            throw io::InputError(std::string("the display's OpenGL refuses a shader: ") + log);
        }
        return made;
    }

    void make_program() {
        if (program) return;
        const GLuint first = shader(GL_VERTEX_SHADER, vertex_shader),
                     second = shader(GL_FRAGMENT_SHADER, fragment_shader);
        program = gl.CreateProgram();
        gl.AttachShader(program, first);
        gl.AttachShader(program, second);
        gl.LinkProgram(program);
        gl.DeleteShader(first);
        gl.DeleteShader(second);
        camera_at = gl.GetUniformLocation(program, "camera");
        eye_at = gl.GetUniformLocation(program, "eye");
        opacity_at = gl.GetUniformLocation(program, "opacity");
        rim_at = gl.GetUniformLocation(program, "rim");
        shift_at = gl.GetUniformLocation(program, "shift");
    }

    void make_target(int columns, int rows) {
        if (target && columns == width && rows == height) return;
        free_target();
        width = columns;
        height = rows;
        turned = true;
        gl.GenTextures(1, &picture);
        gl.BindTexture(GL_TEXTURE_2D, picture);
        gl.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
        gl.GenRenderbuffers(1, &depth);
        gl.BindRenderbuffer(GL_RENDERBUFFER, depth);
        gl.RenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, width, height);
        gl.GenFramebuffers(1, &target);
        gl.BindFramebuffer(GL_FRAMEBUFFER, target);
        gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, picture, 0);
        gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth);
        const bool whole = gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
        gl.BindFramebuffer(GL_FRAMEBUFFER, 0);
        if (!whole) throw io::InputError("the display's OpenGL has no target for the teacher's view");
    }

    void send(Mesh& mesh, const std::vector<Vertex>& vertices, const std::vector<unsigned>& indices) const {
        if (!mesh.array) {
            gl.GenVertexArrays(1, &mesh.array);
            gl.GenBuffers(1, &mesh.vertices);
            gl.GenBuffers(1, &mesh.indices);
            gl.BindVertexArray(mesh.array);
            gl.BindBuffer(GL_ARRAY_BUFFER, mesh.vertices);
            gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, mesh.indices);
            for (GLuint k = 0; k < 3; ++k) {
                gl.EnableVertexAttribArray(k);
                gl.VertexAttribPointer(k, 3, GL_FLOAT, GL_FALSE, sizeof(Vertex),
                                       reinterpret_cast<const void*>(k * sizeof(glm::vec3)));
            }
        }
        gl.BindVertexArray(mesh.array);
        gl.BindBuffer(GL_ARRAY_BUFFER, mesh.vertices);
        gl.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(Vertex)),
                      vertices.data(), GL_DYNAMIC_DRAW);
        gl.BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof(unsigned)),
                      indices.data(), GL_DYNAMIC_DRAW);
        mesh.count = static_cast<int>(indices.size());
        gl.BindVertexArray(0);
    }

    void send_lumen(const anatomy::Anatomy& anatomy, const std::vector<Eigen::Vector3f>& moves) {
        if (drawn_lumen == &anatomy && drawn_moves == moves) return;
        drawn_lumen = &anatomy;
        drawn_moves = moves;
        geometry::TriangleMesh mesh = anatomy.lumen;
        for (std::size_t k = 0; k < moves.size(); ++k) mesh.vertices[k] += moves[k].cast<double>();
        std::vector<Vertex> vertices(mesh.vertices.size());
        for (std::size_t k = 0; k < vertices.size(); ++k)
            vertices[k] = {single(mesh.vertices[k]), glm::vec3(0), glm::vec3(0.95f, 0.55f, 0.48f)};
        std::vector<unsigned> indices;
        indices.reserve(3 * mesh.triangles.size());
        for (const auto& t : mesh.triangles) {
            const geometry::Vec3 normal =
                (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
            for (int k = 0; k < 3; ++k) {
                vertices[t[k]].normal += single(normal);
                indices.push_back(static_cast<unsigned>(t[k]));
            }
        }
        send(lumen, vertices, indices);
    }

    /// Draws the devices with eight sides, as thick as the outermost is.
    void send_wire(const room::SolverView& solver) {
        constexpr int sides = 8;
        std::vector<Vertex> vertices;
        std::vector<unsigned> indices;
        const std::size_t count = solver.joints.size();
        glm::vec3 across(0, 1, 0);
        for (std::size_t i = 0; i < count; ++i) {
            const geometry::Vec3 along =
                solver.joints[std::min(i + 1, count - 1)] - solver.joints[i == 0 ? 0 : i - 1];
            const glm::vec3 forward = glm::normalize(single(along) + glm::vec3(1e-6f));
            across -= glm::dot(across, forward) * forward;
            if (glm::length(across) < 1e-3f) across = glm::cross(forward, glm::vec3(0.3f, 0.8f, 0.5f));
            across = glm::normalize(across);
            const glm::vec3 up = glm::cross(forward, across);
            const double force = i < solver.contacts.size() ? solver.contacts[i].force() : 0;
            const glm::vec3 tint = single(force_colour(force));
            const float radius = thicker * (i < solver.radii.size() ? solver.radii[i] : 0.45f);
            for (int k = 0; k < sides; ++k) {
                const float angle = 2 * std::numbers::pi_v<float> * k / sides;
                const glm::vec3 normal = std::cos(angle) * across + std::sin(angle) * up;
                vertices.push_back({single(solver.joints[i]) + radius * normal, normal, tint});
            }
            if (i > 0) join_to_last_ring(indices, vertices.size() - sides, sides);
        }
        send(wire, vertices, indices);

        std::vector<Vertex> ends;
        std::vector<unsigned> lines;
        for (std::size_t i = 0; i < std::min(count, solver.contacts.size()); ++i) {
            const physics::WallContact& contact = solver.contacts[i];
            if (!contact.touches()) continue;
            const glm::vec3 from = single(solver.joints[i]), tint = single(force_colour(contact.force()));
            const float length = std::clamp(force_length * static_cast<float>(contact.force()), 2.0f, 40.0f);
            for (const glm::vec3& place : {from, from - length * single(contact.normal)}) {
                lines.push_back(static_cast<unsigned>(ends.size()));
                ends.push_back({place, glm::vec3(0), tint});
            }
        }
        send(forces, ends, lines);
    }

    void send_goal(const geometry::Vec3& centre, double radius) {
        if (goal.count) return;
        constexpr int rings = 12, sides = 18;
        std::vector<Vertex> vertices;
        std::vector<unsigned> indices;
        for (int j = 0; j <= rings; ++j) {
            for (int k = 0; k < sides; ++k) {
                const float polar = std::numbers::pi_v<float> * j / rings,
                            turn = 2 * std::numbers::pi_v<float> * k / sides;
                const glm::vec3 normal(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn),
                                       std::cos(polar));
                vertices.push_back({single(centre) + static_cast<float>(radius) * normal, normal,
                                    glm::vec3(0.96f, 0.80f, 0.24f)});
            }
            if (j > 0) join_to_last_ring(indices, vertices.size() - sides, sides);
        }
        send(goal, vertices, indices);
    }

    void draw_mesh(const Mesh& mesh, GLenum shape, float opacity, float rim) const {
        if (!mesh.count) return;
        gl.Uniform1f(opacity_at, opacity);
        gl.Uniform1f(rim_at, rim);
        gl.BindVertexArray(mesh.array);
        gl.DrawElements(shape, mesh.count, GL_UNSIGNED_INT, nullptr);
    }

    /// `solver` may be null: the eye then looks at `target`.
    void paint(const room::SolverView* solver, const geometry::Vec3& target) {
        const bool devices = solver && !solver->joints.empty();
        const glm::vec3 shift = devices ? single(solver->shift) : glm::vec3(0);
        const glm::vec3 centre = single(devices ? solver->joints.back() : target) + shift;
        // From the patient's front, head up, as in the image.
        const glm::vec3 eye =
            centre + distance * glm::vec3(std::sin(azimuth) * std::cos(elevation),
                                          -std::cos(azimuth) * std::cos(elevation), std::sin(elevation));
        const glm::mat4 projection =
            glm::perspective(0.7f, static_cast<float>(width) / static_cast<float>(std::max(1, height)),
                             distance / 50, distance + 3000);
        const glm::mat4 camera = projection * glm::lookAt(eye, centre, glm::vec3(0, 0, 1));
        gl.BindFramebuffer(GL_FRAMEBUFFER, this->target);
        gl.Viewport(0, 0, width, height);
        gl.ClearColor(7 / 255.f, 10 / 255.f, 12 / 255.f, 1);
        gl.DepthMask(GL_TRUE);
        gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        gl.Disable(GL_SCISSOR_TEST);
        gl.Enable(GL_DEPTH_TEST);
        gl.DepthFunc(GL_LEQUAL);
        gl.Disable(GL_BLEND);
        gl.Disable(GL_CULL_FACE);
        gl.UseProgram(program);
        gl.UniformMatrix4fv(camera_at, 1, GL_FALSE, glm::value_ptr(camera));
        gl.Uniform3f(eye_at, eye.x, eye.y, eye.z);
        gl.Uniform3f(shift_at, shift.x, shift.y, shift.z);
        if (devices) {
            draw_mesh(wire, GL_TRIANGLES, 1, 0);
            draw_mesh(forces, GL_LINES, 1, 0);
        }
        gl.Enable(GL_BLEND);
        gl.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
        gl.DepthMask(GL_FALSE);
        draw_mesh(goal, GL_TRIANGLES, 0.25f, 0.6f);
        gl.Enable(GL_CULL_FACE);
        for (const GLenum side : {GL_FRONT, GL_BACK}) {  // back surfaces first
            gl.CullFace(side);
            draw_mesh(lumen, GL_TRIANGLES, 0.2f, 0.8f);
        }
        gl.Disable(GL_CULL_FACE);
        gl.Disable(GL_DEPTH_TEST);
        gl.DepthMask(GL_TRUE);
        gl.BindVertexArray(0);
        gl.UseProgram(0);
        gl.BindFramebuffer(GL_FRAMEBUFFER, 0);
    }
};

PatientScene::PatientScene(const Gl& gl) : content_(std::make_unique<Content>(gl)) {}
PatientScene::~PatientScene() = default;

void PatientScene::reset() {
    content_->drawn_lumen = nullptr;
    content_->goal.count = 0;
    content_->drawn_view = -1;
}

void PatientScene::turn(float right, float up) {
    content_->azimuth -= right;
    content_->elevation = std::clamp(content_->elevation + up, -1.5f, 1.5f);
    content_->turned = true;
}

void PatientScene::zoom(float factor) {
    content_->distance = std::clamp(content_->distance * factor, 15.0f, 2000.0f);
    content_->turned = true;
}

GLuint PatientScene::picture(const room::View& view, const anatomy::Anatomy& anatomy,
                             const geometry::Vec3& target, double radius, int width, int height) {
    Content& c = *content_;
    c.make_program();
    c.make_target(width, height);
    const room::SolverView* solver = view.solver.get();
    if (!c.turned && c.drawn_lumen && view.serial == c.drawn_view) return c.picture;
    c.send_lumen(anatomy, solver ? solver->lumen_moves : std::vector<Eigen::Vector3f>());
    c.send_goal(target, radius);
    if (solver) c.send_wire(*solver);
    c.paint(solver, target);
    c.drawn_view = view.serial;
    c.turned = false;
    return c.picture;
}

}  // namespace app

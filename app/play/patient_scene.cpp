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

glm::vec3 single(const geometry::Vec3& v) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

}  // namespace

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
    bool turned = true;  // the camera has moved since the last picture
    room::Eye eye;

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
        const char* const parts[] = {"#version 330 core\n", text};
        gl.ShaderSource(made, 2, parts, nullptr);
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
        const GLuint first = shader(GL_VERTEX_SHADER, room::patient_vertex_shader),
                     second = shader(GL_FRAGMENT_SHADER, room::patient_fragment_shader);
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

    void send(Mesh& mesh, const room::PatientMesh& made) const {
        const auto& [vertices, indices] = made;
        if (!mesh.array) {
            gl.GenVertexArrays(1, &mesh.array);
            gl.GenBuffers(1, &mesh.vertices);
            gl.GenBuffers(1, &mesh.indices);
            gl.BindVertexArray(mesh.array);
            gl.BindBuffer(GL_ARRAY_BUFFER, mesh.vertices);
            gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, mesh.indices);
            for (GLuint k = 0; k < 3; ++k) {
                gl.EnableVertexAttribArray(k);
                gl.VertexAttribPointer(k, 3, GL_FLOAT, GL_FALSE, sizeof(room::PatientVertex),
                                       reinterpret_cast<const void*>(k * sizeof(Eigen::Vector3f)));
            }
        }
        gl.BindVertexArray(mesh.array);
        gl.BindBuffer(GL_ARRAY_BUFFER, mesh.vertices);
        gl.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(room::PatientVertex)),
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
        send(lumen, room::lumen_mesh(anatomy, moves));
    }

    void draw_mesh(const Mesh& mesh, GLenum shape, room::Veil veil) const {
        if (!mesh.count) return;
        gl.Uniform1f(opacity_at, veil.opacity);
        gl.Uniform1f(rim_at, veil.rim);
        gl.BindVertexArray(mesh.array);
        gl.DrawElements(shape, mesh.count, GL_UNSIGNED_INT, nullptr);
    }

    /// `solver` may be null: the eye then looks at `target`.
    void paint(const room::SolverView* solver, const geometry::Vec3& target) {
        const bool devices = solver && !solver->joints.empty();
        const glm::vec3 shift = devices ? single(solver->shift) : glm::vec3(0);
        const glm::vec3 centre = single(devices ? solver->joints.back() : target) + shift;
        const glm::vec3 place =
            centre + eye.distance * glm::vec3(std::sin(eye.azimuth) * std::cos(eye.elevation),
                                              -std::cos(eye.azimuth) * std::cos(eye.elevation),
                                              std::sin(eye.elevation));
        const glm::mat4 projection =
            glm::perspective(eye.field, static_cast<float>(width) / static_cast<float>(std::max(1, height)),
                             eye.distance / 50, eye.distance + 3000);
        const glm::mat4 camera = projection * glm::lookAt(place, centre, glm::vec3(0, 0, 1));
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
        gl.Uniform3f(eye_at, place.x, place.y, place.z);
        gl.Uniform3f(shift_at, shift.x, shift.y, shift.z);
        if (devices) {
            draw_mesh(wire, GL_TRIANGLES, room::solid);
            draw_mesh(forces, GL_LINES, room::solid);
        }
        gl.Enable(GL_BLEND);
        gl.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
        gl.DepthMask(GL_FALSE);
        draw_mesh(goal, GL_TRIANGLES, room::target_veil);
        gl.Enable(GL_CULL_FACE);
        for (const GLenum side : {GL_FRONT, GL_BACK}) {  // back surfaces first
            gl.CullFace(side);
            draw_mesh(lumen, GL_TRIANGLES, room::lumen_veil);
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
    content_->eye.turn(right, up);
    content_->turned = true;
}

void PatientScene::zoom(float factor) {
    content_->eye.zoom(factor);
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
    if (!c.goal.count) c.send(c.goal, room::target_mesh(target, radius));
    if (solver) {
        c.send(c.wire, room::device_mesh(*solver));
        c.send(c.forces, room::force_lines(*solver));
    }
    c.paint(solver, target);
    c.drawn_view = view.serial;
    c.turned = false;
    return c.picture;
}

}  // namespace app

#include "app/play/instructor.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <fmt/format.h>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <imgui.h>
#include <numbers>

#include "app/play/theme.h"
#include "engine/io/error.h"

namespace app {
namespace {

namespace palette = render::palette;

constexpr std::size_t remembered = 300;                 // frames in the plots
constexpr double least_force = 1e-3, most_force = 0.5;  // ends of the scale of colours [N]
constexpr float force_length = 40;                      // of a line that stands for 1 N [mm]
constexpr double between_pictures = 0.08;               // while the camera rests [s]

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

// Lit from the eye; `rim` makes what is seen edge-on more opaque, so that a vessel shows its outline.
const char* const fragment_shader = R"(#version 330 core
in vec3 world, facing, shade;
uniform vec3 eye;
uniform float opacity, rim;
out vec4 colour;
void main() {
    float size = length(facing);
    float slant = size > 0.0 ? abs(dot(facing / size, normalize(eye - world))) : 1.0;
    colour = vec4(shade * (0.35 + 0.65 * slant), clamp(opacity + rim * pow(1.0 - slant, 2.0), 0.0, 1.0));
})";

struct Method {
    physics::RelaxerKind kind;
    int varied;
};
using physics::RelaxerKind;
constexpr Method methods[] = {
    {RelaxerKind::Global, 2},  {RelaxerKind::FirstOrder, 1}, {RelaxerKind::Segment, 1},
    {RelaxerKind::Segment, 2}, {RelaxerKind::Segment, 3},    {RelaxerKind::Segment, 4},
    {RelaxerKind::Segment, 5}, {RelaxerKind::Combined, 2},   {RelaxerKind::Konings, 1}};
constexpr int method_count = static_cast<int>(std::size(methods));
constexpr const char* method_names[method_count] = {"global", "first order", "M = 1",    "M = 2",  "M = 3",
                                                    "M = 4",  "M = 5",       "combined", "Konings"};

int method_of(const physics::RelaxerConfig& config) {
    for (int k = 0; k < method_count; ++k)
        if (methods[k].kind == config.kind &&
            (config.kind != RelaxerKind::Segment || methods[k].varied == config.varied_segments))
            return k;
    return 0;
}

/// Told apart by eyes that miss red or green (Okabe and Ito's eight, and white).
ImU32 method_colour(int method) {
    constexpr ImU32 colours[] = {
        IM_COL32(230, 159, 0, 255), IM_COL32(204, 121, 167, 255), IM_COL32(86, 180, 233, 255),
        IM_COL32(0, 158, 115, 255), IM_COL32(240, 228, 66, 255),  IM_COL32(0, 114, 178, 255),
        IM_COL32(213, 94, 0, 255),  IM_COL32(160, 160, 160, 255), IM_COL32(255, 255, 255, 255)};
    return colours[method % std::size(colours)];
}

glm::vec3 single(const geometry::Vec3& v) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// Dark blue over green to yellow, told apart without red and green.
glm::vec3 force_colour(double force) {
    static const std::array<glm::vec3, 5> stops = {{{0.42f, 0.45f, 0.80f},
                                                    {0.23f, 0.60f, 0.75f},
                                                    {0.20f, 0.75f, 0.55f},
                                                    {0.60f, 0.85f, 0.30f},
                                                    {1.00f, 0.92f, 0.20f}}};
    const double part =
        force <= least_force ? 0 : std::log(force / least_force) / std::log(most_force / least_force);
    const float at = static_cast<float>(std::clamp(part, 0.0, 1.0)) * (stops.size() - 1);
    const std::size_t first = std::min<std::size_t>(stops.size() - 2, static_cast<std::size_t>(at));
    return glm::mix(stops[first], stops[first + 1], at - static_cast<float>(first));
}

}  // namespace

struct Instructor::Scene {
    const Gl& gl;
    GLuint program = 0, target = 0, picture = 0, depth = 0;
    GLint camera_at = -1, eye_at = -1, opacity_at = -1, rim_at = -1, shift_at = -1;
    int width = 0, height = 0;
    struct Mesh {
        GLuint array = 0, vertices = 0, indices = 0;
        int count = 0;
    } lumen, wire, forces, goal;
    const void* drawn_lumen = nullptr;
    long drawn_view = -1;
    bool turned = true;  // the camera has moved since the last picture
    std::chrono::steady_clock::time_point drawn_at;
    float azimuth = 0, elevation = 0.15f, distance = 320;  // of the eye [rad], [mm]
    std::deque<float> motion_ms, image_ms, steps, residual;
    struct Dot {
        double ms, error;
        int method;
    };
    std::deque<Dot> dots;                    // of frames with a motion
    std::optional<exercise::Tuning> edited;  // by sliders that are held
    long seen = -1;

    explicit Scene(const Gl& functions) : gl(functions) {}
    ~Scene() {
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
        if (!whole) throw io::InputError("the display's OpenGL has no target for the instructor's view");
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

    void send_lumen(const anatomy::Anatomy& anatomy) {
        if (drawn_lumen == &anatomy) return;
        drawn_lumen = &anatomy;
        const auto& mesh = anatomy.lumen;
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

    /// Of eight sides, wider than it is so that it can be seen from afar.
    void send_wire(const room::SolverView& solver) {
        constexpr int sides = 8;
        const float radius = 0.9f;
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
            const glm::vec3 tint = force_colour(force);
            for (int k = 0; k < sides; ++k) {
                const float angle = 2 * std::numbers::pi_v<float> * k / sides;
                const glm::vec3 normal = std::cos(angle) * across + std::sin(angle) * up;
                vertices.push_back({single(solver.joints[i]) + radius * normal, normal, tint});
                if (i == 0) continue;
                const unsigned a = static_cast<unsigned>((i - 1) * sides + k),
                               b = static_cast<unsigned>((i - 1) * sides + (k + 1) % sides);
                for (const unsigned corner : {a, b, a + sides, b, b + sides, a + sides})
                    indices.push_back(corner);
            }
        }
        send(wire, vertices, indices);

        std::vector<Vertex> ends;
        std::vector<unsigned> lines;
        for (std::size_t i = 0; i < std::min(count, solver.contacts.size()); ++i) {
            const physics::WallContact& contact = solver.contacts[i];
            if (!contact.touches()) continue;
            const glm::vec3 from = single(solver.joints[i]), tint = force_colour(contact.force());
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
        for (int j = 0; j <= rings; ++j)
            for (int k = 0; k < sides; ++k) {
                const float polar = std::numbers::pi_v<float> * j / rings,
                            turn = 2 * std::numbers::pi_v<float> * k / sides;
                const glm::vec3 normal(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn),
                                       std::cos(polar));
                vertices.push_back({single(centre) + static_cast<float>(radius) * normal, normal,
                                    glm::vec3(0.96f, 0.80f, 0.24f)});
                if (j == 0) continue;
                const unsigned a = static_cast<unsigned>((j - 1) * sides + k),
                               b = static_cast<unsigned>((j - 1) * sides + (k + 1) % sides);
                for (const unsigned corner : {a, b, a + sides, b, b + sides, a + sides})
                    indices.push_back(corner);
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

    void paint(const room::SolverView& solver) {
        const glm::vec3 shift = single(solver.shift);
        const glm::vec3 centre =
            (solver.joints.empty() ? glm::vec3(0) : single(solver.joints.back())) + shift;
        // From the patient's front, head up, as the image has it.
        const glm::vec3 eye =
            centre + distance * glm::vec3(std::sin(azimuth) * std::cos(elevation),
                                          -std::cos(azimuth) * std::cos(elevation), std::sin(elevation));
        const glm::mat4 projection =
            glm::perspective(0.7f, static_cast<float>(width) / static_cast<float>(std::max(1, height)),
                             distance / 50, distance + 3000);
        const glm::mat4 camera = projection * glm::lookAt(eye, centre, glm::vec3(0, 0, 1));
        gl.BindFramebuffer(GL_FRAMEBUFFER, target);
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
        draw_mesh(wire, GL_TRIANGLES, 1, 0);
        draw_mesh(forces, GL_LINES, 1, 0);
        gl.Enable(GL_BLEND);
        gl.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
        gl.DepthMask(GL_FALSE);
        draw_mesh(goal, GL_TRIANGLES, 0.25f, 0.6f);
        gl.Enable(GL_CULL_FACE);
        for (const GLenum side : {GL_FRONT, GL_BACK}) {  // what is behind first
            gl.CullFace(side);
            draw_mesh(lumen, GL_TRIANGLES, 0.13f, 0.75f);
        }
        gl.Disable(GL_CULL_FACE);
        gl.Disable(GL_DEPTH_TEST);
        gl.DepthMask(GL_TRUE);
        gl.BindVertexArray(0);
        gl.UseProgram(0);
        gl.BindFramebuffer(GL_FRAMEBUFFER, 0);
    }

    /// Time of a frame's motion against the distance from rest that is left, both by powers of ten.
    void speed_against_accuracy(float unit) const {
        constexpr double least_ms = 0.01, most_ms = 1000, least_mm = 1e-10, most_mm = 10;
        ImGui::TextDisabled("distance from rest [mm] over time [ms]");
        const ImVec2 size(unit * 214, unit * 130), corner = ImGui::GetCursorScreenPos();
        ImDrawList& list = *ImGui::GetWindowDrawList();
        list.AddRectFilled(corner, ImVec2(corner.x + size.x, corner.y + size.y), colour(palette::well));
        const auto at = [&](double ms, double mm) {
            const double x = std::log(ms / least_ms) / std::log(most_ms / least_ms);
            const double y = std::log(mm / least_mm) / std::log(most_mm / least_mm);
            return ImVec2(corner.x + size.x * static_cast<float>(std::clamp(x, 0.0, 1.0)),
                          corner.y + size.y * static_cast<float>(1 - std::clamp(y, 0.0, 1.0)));
        };
        for (double ms = least_ms; ms <= most_ms; ms *= 10)
            list.AddLine(at(ms, least_mm), at(ms, most_mm), colour(palette::rule));
        for (double mm = least_mm; mm <= most_mm * 1.1; mm *= 1000)
            list.AddLine(at(least_ms, mm), at(most_ms, mm), colour(palette::rule));
        list.AddLine(at(1000.0 / 15, least_mm), at(1000.0 / 15, most_mm), colour(palette::alarm));
        for (const Dot& dot : dots)
            list.AddCircleFilled(at(dot.ms, std::max(least_mm, dot.error)), unit * 2,
                                 method_colour(dot.method), 6);
        ImGui::Dummy(size);
        ImGui::TextDisabled("0.01 to 1000 ms, 1e-10 to 10 mm");
        ImGui::TextDisabled("red: the time of a frame");
    }

    /// What was changed and let go.
    std::optional<exercise::Tuning> controls(const exercise::Tuning& now, float unit) {
        exercise::Tuning next = edited.value_or(now);
        bool held = false, done = false;
        const auto slider = [&](const char* name, double& value, float least, float most,
                                const char* format) {
            float shown = static_cast<float>(value);
            ImGui::SetNextItemWidth(unit * 120);
            if (ImGui::SliderFloat(name, &shown, least, most, format,
                                   ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp))
                value = shown;
            held = held || ImGui::IsItemActive();
            done = done || ImGui::IsItemDeactivatedAfterEdit();
        };
        slider("EI shaft", next.shaft_rigidity, 1, 5000, "%.0f N mm2");
        slider("EI tip", next.tip_rigidity, 0.5f, 200, "%.1f N mm2");
        slider("wall k", next.wall_stiffness, 0.1f, 200, "%.1f N/mm");
        slider("segment", next.segment_length, 0.5f, 6, "%.2f mm");
        int method = method_of(next.relaxer);
        ImGui::SetNextItemWidth(unit * 120);
        if (ImGui::Combo("method", &method, method_names, method_count)) {
            next.relaxer.kind = methods[method].kind;
            next.relaxer.varied_segments = methods[method].varied;
            done = true;
        }
        ImGui::TextDisabled("friction: none in this model");
        edited = held && !done ? std::optional(next) : std::nullopt;
        return done ? std::optional(next) : std::nullopt;
    }

    void remember(const room::View& view) {
        if (!view.solver || view.frames == seen) return;
        seen = view.frames;
        const room::SolverView& solver = *view.solver;
        const auto push = [](std::deque<float>& values, double value) {
            values.push_back(static_cast<float>(value));
            if (values.size() > remembered) values.pop_front();
        };
        push(motion_ms, solver.motion_ms);
        push(image_ms, solver.image_ms);
        push(steps, solver.relax.newton_steps > 0 ? solver.relax.newton_steps : solver.relax.updates);
        push(residual, std::log10(std::max(1e-16, solver.relax.gradient)));
        if (solver.relax.updates == 0 && solver.relax.newton_steps == 0) return;
        dots.push_back({solver.motion_ms, solver.error, method_of(solver.tuning.relaxer)});
        if (dots.size() > 3 * remembered) dots.pop_front();
    }
};

Instructor::Instructor(const Gl& gl) : scene_(std::make_unique<Scene>(gl)) {}
Instructor::~Instructor() = default;

void Instructor::reset() {
    Scene& s = *scene_;
    s.drawn_lumen = nullptr;
    s.goal.count = 0;
    s.drawn_view = s.seen = -1;
    s.dots.clear();
    s.edited.reset();
    for (auto* values : {&s.motion_ms, &s.image_ms, &s.steps, &s.residual}) values->clear();
}

std::optional<exercise::Tuning> Instructor::draw(const room::View& view, const anatomy::Anatomy& anatomy,
                                                 const geometry::Vec3& target, double radius,
                                                 const render::Box& area, const Window& window) {
    Scene& s = *scene_;
    s.remember(view);
    const float unit = window.unit();
    ImGui::SetNextWindowPos(ImVec2(area.left, area.top), ImGuiCond_Appearing);
    ImGui::SetNextWindowSize(ImVec2(area.right - area.left, area.bottom - area.top), ImGuiCond_Appearing);
    ImGui::Begin("Instructor's view", nullptr,
                 ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoCollapse);
    if (!view.solver) {
        ImGui::TextUnformatted("It shows the wire from the next frame on.");
        ImGui::End();
        return std::nullopt;
    }
    const room::SolverView& solver = *view.solver;
    ImGui::BeginChild("solver", ImVec2(unit * 230, 0));
    const auto plot = [&](const char* name, std::deque<float>& values, const std::string& last, float most) {
        std::vector<float> row(values.begin(), values.end());
        const float low = row.empty() ? 0 : std::min(0.0f, *std::min_element(row.begin(), row.end()));
        const float high = row.empty() ? 1 : std::max(most, *std::max_element(row.begin(), row.end()));
        ImGui::TextDisabled("%s", name);
        ImGui::PlotLines(fmt::format("##{}", name).c_str(), row.data(), static_cast<int>(row.size()), 0,
                         last.c_str(), low, high, ImVec2(unit * 214, unit * 44));
    };
    plot("motion and solver [ms]", s.motion_ms,
         fmt::format("{:.2f} of {:.0f} ms", solver.motion_ms, solver.frame_ms), 1);
    plot("image [ms]", s.image_ms, fmt::format("{:.1f} ms", solver.image_ms), 1);
    plot(solver.relax.newton_steps > 0 ? "Newton steps" : "updates", s.steps,
         fmt::format("{} (window {})",
                     solver.relax.newton_steps > 0 ? solver.relax.newton_steps : solver.relax.updates,
                     solver.relax.window),
         1);
    plot("residual |g|/C, power of ten", s.residual, fmt::format("{:.1e}", solver.relax.gradient), 0);
    ImGui::Text("%d segments, %d contacts", static_cast<int>(solver.joints.size()) - 1,
                solver.relax.contacts);
    ImGui::PushStyleColor(
        ImGuiCol_Text,
        tint(solver.relax.strict_minimum && solver.relax.at_rest ? palette::good : palette::caution));
    ImGui::TextUnformatted(solver.relax.strict_minimum && solver.relax.at_rest ? "at rest: a strict minimum"
                           : solver.relax.at_rest                              ? "at rest, not certified"
                                                                               : "not at rest yet");
    ImGui::PopStyleColor();
    ImGui::TextDisabled("wall force, %.3f to %.1f N", least_force, most_force);
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    constexpr int shades = 40;
    for (int k = 0; k < shades; ++k) {
        const glm::vec3 c =
            force_colour(least_force * std::pow(most_force / least_force, k / (shades - 1.0)));
        const float step = unit * 210 / shades;
        ImGui::GetWindowDrawList()->AddRectFilled(ImVec2(corner.x + k * step, corner.y),
                                                  ImVec2(corner.x + (k + 1) * step, corner.y + unit * 8),
                                                  ImGui::ColorConvertFloat4ToU32(ImVec4(c.r, c.g, c.b, 1)));
    }
    ImGui::Dummy(ImVec2(0, unit * 12));
    s.speed_against_accuracy(unit);
    const std::optional<exercise::Tuning> asked = s.controls(solver.tuning, unit);
    ImGui::EndChild();
    ImGui::SameLine();

    const ImVec2 room = ImGui::GetContentRegionAvail();
    const int columns = std::max(16, static_cast<int>(room.x)), rows = std::max(16, static_cast<int>(room.y));
    s.make_program();
    s.make_target(columns, rows);
    s.send_lumen(anatomy);
    s.send_goal(target, radius);
    const auto now = std::chrono::steady_clock::now();
    const bool late = std::chrono::duration<double>(now - s.drawn_at).count() > between_pictures;
    if (s.turned || (view.serial != s.drawn_view && late)) {
        s.send_wire(solver);
        s.paint(solver);
        s.drawn_view = view.serial;
        s.drawn_at = now;
        s.turned = false;
    }
    ImGui::Image(reinterpret_cast<void*>(static_cast<std::intptr_t>(s.picture)),
                 ImVec2(static_cast<float>(columns), static_cast<float>(rows)), ImVec2(0, 1), ImVec2(1, 0));
    const ImGuiIO& io = ImGui::GetIO();
    if (ImGui::IsItemHovered()) {
        if (io.MouseWheel != 0) {
            s.distance = std::clamp(s.distance * (io.MouseWheel > 0 ? 0.85f : 1.18f), 15.0f, 2000.0f);
            s.turned = true;
        }
        if (ImGui::IsMouseDown(0) && (io.MouseDelta.x != 0 || io.MouseDelta.y != 0)) {
            s.azimuth -= 0.008f * io.MouseDelta.x;
            s.elevation = std::clamp(s.elevation + 0.008f * io.MouseDelta.y, -1.5f, 1.5f);
            s.turned = true;
        }
    }
    ImGui::End();
    return asked;
}

}  // namespace app

#include "render/panel/canvas.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <imgui.h>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "render/panel/panel.h"
#include "render/picture/gl_context.h"
#include "render/picture/image.h"
#include "render/picture/resample.h"

namespace render {

namespace {

// The top row is drawn first, and so also read back first.
constexpr const char* panel_vertex_shader = R"(
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

constexpr const char* panel_fragment_shader = R"(
uniform sampler2D picture;
in vec2 texture_place;
in vec4 ink;
out vec4 colour;
void main() { colour = ink * texture(picture, texture_place); })";

/// A backend of Dear ImGui for the off-screen context: textured triangles, alpha blending, scissors. Debian
/// ships the source of a backend only with the documentation, which slim systems omit, and the compiled one
/// finds no OpenGL under OSMesa. To be used by one thread at a time.
class DrawDataRenderer : GlContext {
public:
    /// A target of columns × rows pixels. Throws std::runtime_error when GL fails.
    DrawDataRenderer(int columns, int rows) : width(columns), height(rows) {
        const auto use = context.use();
        make_program();
        make_target();
        make_buffers();
        require_no_error("making ready for a panel");
        readback.resize(static_cast<std::size_t>(width) * height * 4);
    }
    ~DrawDataRenderer() {
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
    DrawDataRenderer(const DrawDataRenderer&) = delete;
    DrawDataRenderer& operator=(const DrawDataRenderer&) = delete;

    /// Textures are identified by a number, which is used as their ImTextureID. Coverage multiplies the alpha
    /// of what is drawn with it; width·height values, 255 opaque.
    void set_coverage(int texture, const GrayImage& image) {
        set_texture(texture, image, {GL_ONE, GL_ONE, GL_ONE, GL_RED}, GL_LINEAR);
    }
    /// Opaque grey levels, not interpolated: OpenGL leaves the precision of interpolation to the machine.
    void set_grey(int texture, const GrayImage& image) {
        set_texture(texture, image, {GL_RED, GL_RED, GL_RED, GL_ONE}, GL_NEAREST);
    }

    /// Draws on black. The colours of the draw data are taken as 8-bit levels of the result.
    ColourImage draw(const ImDrawData& data) {
        const auto use = context.use();
        begin();
        for (int n = 0; n < data.CmdListsCount; ++n) draw_list(*data.CmdLists[n]);
        return read();
    }

private:
    struct Texture {
        GLuint name = 0;
        int width = 0;
        int height = 0;
        bool opaque = false;
    };

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
            const auto texture = textures.find(static_cast<int>((std::intptr_t)command.GetTexID()));
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

    int width = 0, height = 0;  // of the target [pixels]
    GLuint program = 0, array = 0, vertices = 0, indices = 0, framebuffer = 0, target = 0;
    std::map<int, Texture> textures;
    std::vector<std::uint8_t> readback;  // red, green, blue, alpha
};

constexpr int atlas_texture = 1;  // 0 would be ImGui's "none"
constexpr int first_slot = 2;

struct FaceSpec {
    float size;  // line height [units]
    bool bold;
};
// In the order of Face.
constexpr std::array<FaceSpec, 5> faces = {
    {{11.0f, false}, {13.0f, false}, {13.0f, true}, {17.0f, false}, {20.0f, true}}};

// Latin, Greek, dashes, quotation marks, arrows, minus.
constexpr ImWchar ranges[] = {0x20,   0xFF,   0x100,  0x17F,  0x370,  0x3FF, 0x2010,
                              0x2027, 0x2190, 0x2193, 0x2212, 0x2212, 0};

ImU32 colour(Ink ink) {
    return IM_COL32(ink.red, ink.green, ink.blue, ink.alpha);
}

std::uint32_t big_endian(const std::vector<char>& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < 4; ++k) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
    return value;
}

/// Empty unless the file is a TrueType font whose tables lie inside it: ImGui aborts the program on others.
std::vector<char> read_font(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    constexpr std::size_t header = 12, entry = 16;
    if (bytes.size() < header || big_endian(bytes, 0) != 0x00010000) return {};
    const std::size_t tables = big_endian(bytes, 4) >> 16;
    if (bytes.size() < header + tables * entry) return {};
    for (std::size_t k = 0; k < tables; ++k) {
        const std::size_t at = header + k * entry;
        if (std::size_t{big_endian(bytes, at + 8)} + big_endian(bytes, at + 12) > bytes.size()) return {};
    }
    return bytes;
}

/// The text in UTF-8, without control characters.
std::string one_line(std::string_view text) {
    std::string line;
    for (std::size_t at = 0; at < text.size();) {
        const auto lead = static_cast<unsigned char>(text[at]);
        const std::size_t length = lead < 0x80    ? 1
                                   : lead >= 0xF0 ? 4
                                   : lead >= 0xE0 ? 3
                                   : lead >= 0xC2 ? 2
                                                  : 0;
        bool whole = length > 0 && lead < 0xF5 && at + length <= text.size();
        for (std::size_t k = 1; whole && k < length; ++k) {
            whole = (static_cast<unsigned char>(text[at + k]) & 0xC0) == 0x80;
        }
        if (whole && lead >= 0x20 && lead != 0x7F) {
            line += text.substr(at, length);
        } else {
            line += ' ';
        }
        at += whole ? length : 1;
    }
    return line;
}

/// Makes a context of ImGui current, and restores the previous one at the end. The current context is one for
/// the whole process, and even ImGui's allocator counts in it: one thread at a time has it.
class CurrentContext {
public:
    explicit CurrentContext(ImGuiContext* context = nullptr)
        : lock_(process_wide()), before_(ImGui::GetCurrentContext()) {
        ImGui::SetCurrentContext(context);
    }
    ~CurrentContext() { ImGui::SetCurrentContext(before_); }
    CurrentContext(const CurrentContext&) = delete;
    CurrentContext& operator=(const CurrentContext&) = delete;

private:
    static std::mutex& process_wide() {
        static std::mutex mutex;
        return mutex;
    }
    const std::lock_guard<std::mutex> lock_;
    ImGuiContext* const before_;
};

/// A sheet of its own: a target, and an ImGui context that nothing else draws with.
struct Sheet {
    struct Slot {
        GrayImage image;
        int width = 0, height = 0;
    };

    /// Destroys a context when no other thread uses ImGui.
    struct Destroy {
        void operator()(ImGuiContext* context) const {
            const CurrentContext none;
            ImGui::DestroyContext(context);
        }
    };

    DrawDataRenderer renderer;
    std::unique_ptr<ImGuiContext, Destroy> context;
    CanvasFaces faces;
    std::array<Slot, 2> slots;

    Sheet(int width, int height, float unit, const std::filesystem::path& folder) : renderer(width, height) {
        {
            const CurrentContext none;
            context.reset(ImGui::CreateContext());
        }
        const CurrentContext current(context.get());
        ImGuiIO& io = ImGui::GetIO();
        io.IniFilename = nullptr;
        io.LogFilename = nullptr;
        io.DisplaySize = ImVec2(float(width), float(height));
        io.DeltaTime = 1.0f / 60.0f;  // nothing drawn depends on it, but ImGui needs one
        io.BackendFlags |= ImGuiBackendFlags_RendererHasVtxOffset;
        ImGuiStyle& style = ImGui::GetStyle();
        style.AntiAliasedLinesUseTex = false;
        style.CircleTessellationMaxError = 0.1f;
        ImFontAtlas& atlas = *io.Fonts;
        faces = add_faces(atlas, unit, folder);
        unsigned char* coverage = nullptr;
        int columns = 0, rows = 0;
        atlas.GetTexDataAsAlpha8(&coverage, &columns, &rows);
        renderer.set_coverage(atlas_texture,
                              {columns, rows, {coverage, coverage + std::size_t(columns) * rows}});
        atlas.SetTexID(texture_id(atlas_texture));
#if IMGUI_VERSION_NUM < 19200  // later ones would drop the glyphs as well
        atlas.ClearInputData();
#endif
        atlas.ClearTexData();
    }

    static ImTextureID texture_id(int texture) {
        return (ImTextureID) static_cast<std::intptr_t>(texture);  // a pointer, later a number
    }
};

}  // namespace

std::filesystem::path font_folder() {
    const char* const named = std::getenv("SELDINGER_FONTS");
    return named && *named ? named : "/usr/share/fonts/truetype/dejavu";
}

CanvasFaces add_faces(ImFontAtlas& atlas, float unit, const std::filesystem::path& folder) {
    const std::vector<char> plain = read_font(folder / "DejaVuSans.ttf"),
                            bold = read_font(folder / "DejaVuSans-Bold.ttf");
    CanvasFaces result;
    result.from_files = !plain.empty() && !bold.empty();
    for (std::size_t k = 0; k < faces.size(); ++k) {
        ImFontConfig config;
        config.SizePixels = std::round(faces[k].size * unit);
        config.OversampleH = config.OversampleV = 1;
        config.PixelSnapH = true;
        if (!result.from_files) {
            result.fonts[k] = atlas.AddFontDefault(&config);
            continue;
        }
        const std::vector<char>& bytes = faces[k].bold ? bold : plain;
        void* kept = IM_ALLOC(bytes.size());  // the atlas frees it
        std::memcpy(kept, bytes.data(), bytes.size());
        result.fonts[k] = atlas.AddFontFromMemoryTTF(kept, static_cast<int>(bytes.size()), config.SizePixels,
                                                     &config, ranges);
    }
    return result;
}

namespace {

/// At which a face was added to its atlas [pixels].
float size_of(const ImFont* font) {
#if IMGUI_VERSION_NUM >= 19200
    return font->LegacySize;
#else
    return font->FontSize;
#endif
}

}  // namespace

struct Canvas::State {
    float unit;
    ImVec2 origin{0, 0};  // [pixels]
    CanvasFaces faces;
    ImDrawList* list = nullptr;
    std::unique_ptr<Sheet> sheet;  // null on a window
    TextSeen seen;

    ImVec2 exact(Point p) const { return {origin.x + p.x * unit, origin.y + p.y * unit}; }
    ImVec2 snapped(Point p) const {
        return {std::round(origin.x + p.x * unit), std::round(origin.y + p.y * unit)};
    }
    ImFont* font(Face face) const { return faces.fonts[static_cast<std::size_t>(face)]; }
    float width_of(const std::string& line, Face face) const {  // [pixels]
        ImFont* f = font(face);
        return f->CalcTextSizeA(size_of(f), 1e9f, 0.0f, line.data(), line.data() + line.size()).x;
    }
    /// The line cut at its end to `room` pixels.
    std::string fitted(std::string line, Face face, float room) const {
        if (width_of(line, face) <= room) return line;
        ImFont* f = font(face);
        const char* end = line.data();
        f->CalcTextSizeA(size_of(f), room - width_of("...", face), 0.0f, line.data(),
                         line.data() + line.size(), &end);
        line.resize(static_cast<std::size_t>(end - line.data()));
        return line.empty() ? line : line + "...";
    }
};

Canvas::Canvas(int width, int height, float unit, const std::filesystem::path& fonts, TextSeen seen)
    : state_(std::make_unique<State>()) {
    state_->unit = unit;
    state_->sheet = std::make_unique<Sheet>(width, height, unit, fonts);
    state_->faces = state_->sheet->faces;
    state_->seen = std::move(seen);
}
Canvas::Canvas(ImDrawList& list, const CanvasFaces& window_faces, float unit, Point origin, TextSeen seen)
    : state_(std::make_unique<State>()) {
    state_->unit = unit;
    state_->origin = {origin.x, origin.y};
    state_->faces = window_faces;
    state_->list = &list;
    state_->seen = std::move(seen);
}
Canvas::~Canvas() = default;

bool Canvas::has_font() const {
    return state_->faces.from_files;
}

ColourImage Canvas::draw(const std::function<void()>& strokes) {
    Sheet& sheet = *state_->sheet;
    const ImDrawData* drawn = nullptr;
    {
        const CurrentContext current(sheet.context.get());
        ImGui::NewFrame();
        state_->list = ImGui::GetBackgroundDrawList();
        try {
            strokes();
        } catch (...) {
            state_->list = nullptr;
            ImGui::EndFrame();
            throw;
        }
        state_->list = nullptr;
        ImGui::Render();
        drawn = ImGui::GetDrawData();
    }
    return sheet.renderer.draw(*drawn);  // of this context alone
}

void Canvas::clip(const Box& b) {
    state_->list->PushClipRect(state_->snapped({b.left, b.top}), state_->snapped({b.right, b.bottom}), true);
}
void Canvas::unclip() {
    state_->list->PopClipRect();
}

void Canvas::box(const Box& b, Ink ink, float rounding) {
    state_->list->AddRectFilled(state_->snapped({b.left, b.top}), state_->snapped({b.right, b.bottom}),
                                colour(ink), rounding * state_->unit);
}

void Canvas::frame(const Box& b, Ink ink, float rounding) {
    state_->list->AddRect(state_->snapped({b.left, b.top}), state_->snapped({b.right, b.bottom}), colour(ink),
                          rounding * state_->unit);
}

void Canvas::line(Point from, Point to, Ink ink, float thickness) {
    path(std::array{from, to}, ink, thickness);
}

void Canvas::path(std::span<const Point> points, Ink ink, float thickness) {
    for (const Point& p : points) state_->list->PathLineTo(state_->exact(p));
    state_->list->PathStroke(colour(ink), ImDrawFlags_None, thickness * state_->unit);
}

void Canvas::polygon(std::span<const Point> points, Ink ink) {
    for (const Point& p : points) state_->list->PathLineTo(state_->exact(p));
    state_->list->PathFillConvex(colour(ink));
}

void Canvas::disc(Point centre, float radius, Ink ink) {
    state_->list->AddCircleFilled(state_->exact(centre), radius * state_->unit, colour(ink));
}

void Canvas::ring(Point centre, float radius, Ink ink, float thickness) {
    state_->list->AddCircle(state_->exact(centre), radius * state_->unit, colour(ink), 0,
                            thickness * state_->unit);
}

void Canvas::arc(Point centre, float radius, float from, float to, Ink ink, float thickness) {
    state_->list->PathArcTo(state_->exact(centre), radius * state_->unit, from, to);
    state_->list->PathStroke(colour(ink), ImDrawFlags_None, thickness * state_->unit);
}

void Canvas::sector(Point centre, float radius, float from, float to, Ink ink) {
    state_->list->PathLineTo(state_->exact(centre));
    state_->list->PathArcTo(state_->exact(centre), radius * state_->unit, from, to);
    state_->list->PathFillConvex(colour(ink));
}

float Canvas::text(Point at, std::string_view words, Face face, Ink ink, Align align, float room) {
    const std::string line = state_->fitted(one_line(words), face, room * state_->unit);
    const float width = state_->width_of(line, face);
    ImVec2 place = state_->exact(at);
    if (align == Align::Centre) place.x -= 0.5f * width;
    if (align == Align::Right) place.x -= width;
    if (state_->seen) state_->seen(*this, line, face, ink, {place.x, place.y});
    ImFont* font = state_->font(face);
    state_->list->AddText(font, size_of(font), ImVec2(std::round(place.x), std::round(place.y)), colour(ink),
                          line.data(), line.data() + line.size());
    return width / state_->unit;
}

float Canvas::name(Point at, std::string_view words, Ink ink) {
    const auto split = words.find('_');
    if (split == std::string_view::npos) return text(at, words, Face::Plain, ink);
    const ImVec2 place = state_->exact(at);
    if (state_->seen) state_->seen(*this, words, Face::Plain, ink, {place.x, place.y});
    const TextSeen seen = std::exchange(state_->seen, nullptr);
    const float width = text(at, words.substr(0, split), Face::Plain, ink) + 1.0f;
    const float below = text({at.x + width, at.y + 5.0f}, words.substr(split + 1), Face::Small, ink);
    state_->seen = seen;
    return width + below;
}

float Canvas::text_width(std::string_view words, Face face) const {
    return state_->width_of(one_line(words), face) / state_->unit;
}

float Canvas::text_height(Face face) const {
    return size_of(state_->font(face)) / state_->unit;
}

void Canvas::picture(int slot, const GrayImage& image, int left, int top, int width, int height) {
    Sheet::Slot& kept = state_->sheet->slots.at(static_cast<std::size_t>(slot));
    const int texture = first_slot + slot;
    if (kept.width != width || kept.height != height || kept.image != image) {
        state_->sheet->renderer.set_grey(texture, resized(image, width, height));
        kept = {image, width, height};
    }
    state_->list->AddImage(Sheet::texture_id(texture), ImVec2(float(left), float(top)),
                           ImVec2(float(left + width), float(top + height)));
}

}  // namespace render

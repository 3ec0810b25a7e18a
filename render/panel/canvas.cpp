#include "render/panel/canvas.h"

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <imgui.h>
#include <iterator>
#include <mutex>
#include <string>
#include <vector>

#include "render/panel/draw_data.h"
#include "render/picture/resample.h"

namespace render {

namespace {

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
        atlas.ClearInputData();
        atlas.ClearTexData();
    }

    static ImTextureID texture_id(int texture) {
        return reinterpret_cast<ImTextureID>(static_cast<std::intptr_t>(texture));
    }
};

}  // namespace

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

struct Canvas::State {
    float unit;
    ImVec2 origin{0, 0};  // [pixels]
    CanvasFaces faces;
    ImDrawList* list = nullptr;
    std::unique_ptr<Sheet> sheet;  // null on a window

    ImVec2 exact(Point p) const { return {origin.x + p.x * unit, origin.y + p.y * unit}; }
    ImVec2 snapped(Point p) const {
        return {std::round(origin.x + p.x * unit), std::round(origin.y + p.y * unit)};
    }
    const ImFont* font(Face face) const { return faces.fonts[static_cast<std::size_t>(face)]; }
    float width_of(const std::string& line, Face face) const {  // [pixels]
        const ImFont* f = font(face);
        return f->CalcTextSizeA(f->FontSize, 1e9f, 0.0f, line.data(), line.data() + line.size()).x;
    }
    /// The line cut at its end to `room` pixels.
    std::string fitted(std::string line, Face face, float room) const {
        if (width_of(line, face) <= room) return line;
        const ImFont* f = font(face);
        const char* end = line.data();
        f->CalcTextSizeA(f->FontSize, room - width_of("...", face), 0.0f, line.data(),
                         line.data() + line.size(), &end);
        line.resize(static_cast<std::size_t>(end - line.data()));
        return line.empty() ? line : line + "...";
    }
};

Canvas::Canvas(int width, int height, float unit, const std::filesystem::path& fonts)
    : state_(std::make_unique<State>()) {
    state_->unit = unit;
    state_->sheet = std::make_unique<Sheet>(width, height, unit, fonts);
    state_->faces = state_->sheet->faces;
}
Canvas::Canvas(ImDrawList& list, const CanvasFaces& window_faces, float unit, Point origin)
    : state_(std::make_unique<State>()) {
    state_->unit = unit;
    state_->origin = {origin.x, origin.y};
    state_->faces = window_faces;
    state_->list = &list;
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
    const ImFont* font = state_->font(face);
    state_->list->AddText(font, font->FontSize, ImVec2(std::round(place.x), std::round(place.y)), colour(ink),
                          line.data(), line.data() + line.size());
    return width / state_->unit;
}

float Canvas::text_width(std::string_view words, Face face) const {
    return state_->width_of(one_line(words), face) / state_->unit;
}

float Canvas::text_height(Face face) const {
    return state_->font(face)->FontSize / state_->unit;
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

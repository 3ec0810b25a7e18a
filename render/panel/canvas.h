#pragma once
/// Lines, text and pictures on a sheet: drawn by Dear ImGui, without any of its windows.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <numbers>
#include <span>
#include <string_view>

#include "render/picture/image.h"

struct ImDrawList;
struct ImFont;
struct ImFontAtlas;

namespace render {

constexpr float half_turn = std::numbers::pi_v<float>;  // [rad]

struct Point {
    float x = 0.0f;
    float y = 0.0f;
};
struct Box {
    float left = 0.0f;
    float top = 0.0f;
    float right = 0.0f;
    float bottom = 0.0f;
};
struct Ink {
    std::uint8_t red = 0;
    std::uint8_t green = 0;
    std::uint8_t blue = 0;
    std::uint8_t alpha = 255;
};
enum class Face { Small, Plain, Bold, Figure, Title };
enum class Align { Left, Centre, Right };

/// One font for each Face.
struct CanvasFaces {
    std::array<ImFont*, 5> fonts{};
    bool from_files = false;  // otherwise ImGui's own face is used
};
/// Adds the faces to an atlas that is not built yet. `fonts`: folder of DejaVuSans.ttf and
/// DejaVuSans-Bold.ttf.
CanvasFaces add_faces(ImFontAtlas&, float unit, const std::filesystem::path& fonts);

/// All lengths are in units; a sheet made with `unit` = 1 has one unit per pixel. Positions of text, boxes
/// and pictures are rounded to pixels. Later strokes cover earlier ones. The same calls give the same bytes.
class Canvas {
public:
    /// Called for each text before it is drawn, with the place of its upper left corner [pixels]. A name with
    /// a subscript, "K_a,r", is one text.
    using TextSeen = std::function<void(const Canvas&, std::string_view, Face, Ink, Point pixels)>;

    /// `fonts`: folder of DejaVuSans.ttf and DejaVuSans-Bold.ttf; without them ImGui's own face is used.
    /// Throws std::runtime_error when GL fails.
    Canvas(int width, int height, float unit, const std::filesystem::path& fonts, TextSeen = nullptr);
    /// Adds strokes to a draw list of a window's own ImGui, `origin` [pixels] from its upper left corner.
    /// draw() and pictures are for sheets only. The faces' atlas must be that of the list.
    Canvas(ImDrawList&, const CanvasFaces&, float unit, Point origin, TextSeen = nullptr);
    ~Canvas();
    Canvas(const Canvas&) = delete;
    Canvas& operator=(const Canvas&) = delete;

    bool has_font() const;  // whether the faces come from `fonts`

    /// Calls `strokes`, which draws on this sheet, and returns the sheet; an exception passes through. Sheets
    /// of several threads are drawn at once, but their strokes in turn: `strokes` must not make or draw
    /// another sheet. A window's ImGui in the same thread is left unchanged; one in another thread must not
    /// be drawing.
    ColourImage draw(const std::function<void()>& strokes);

    void clip(const Box&);  // until the matching `unclip`, nothing appears outside; may be nested
    void unclip();

    void box(const Box&, Ink, float rounding = 0.0f);
    void frame(const Box&, Ink, float rounding = 0.0f);
    void line(Point, Point, Ink, float thickness = 1.0f);
    void path(std::span<const Point>, Ink, float thickness = 1.0f);
    void polygon(std::span<const Point>, Ink);  // convex, clockwise on the sheet
    void disc(Point centre, float radius, Ink);
    void ring(Point centre, float radius, Ink, float thickness = 1.0f);
    /// Angles from +x toward +y, clockwise on the sheet [rad].
    void arc(Point centre, float radius, float from, float to, Ink, float thickness = 1.0f);
    void sector(Point centre, float radius, float from, float to, Ink);  // at most half a turn

    /// One line with its upper edge at y; the text is aligned at x. Broken or control characters become
    /// spaces; text wider than `room` is cut and ends in dots. Returns the width drawn.
    float text(Point, std::string_view, Face, Ink, Align = Align::Left, float room = 1e6f);
    /// Draws "K_a,r" as K with the subscript a,r. Returns the width drawn.
    float name(Point, std::string_view, Ink);
    float text_width(std::string_view, Face) const;
    float text_height(Face) const;

    /// Fills the pixels [left, left + width) × [top, top + height) of the sheet, not units. The image is
    /// unaltered at its own size, averaged over each new pixel where smaller, interpolated where larger.
    /// Slots 0 and 1 remember their last picture. The image must have pixels.
    void picture(int slot, const GrayImage&, int left, int top, int width, int height);

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace render

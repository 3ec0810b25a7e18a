#include "render/panel/image_marks.h"

#include <numbers>
#include <string>
#include <string_view>

#include "render/panel/palette.h"

namespace render {

namespace {

/// Draws text that is readable on any image.
float marked(Canvas& canvas, Point at, std::string_view words, Face face, Ink ink, Align align = Align::Left,
             float room = 1e6f) {
    for (const Point shift : {Point{-1, 0}, Point{1, 0}, Point{0, -1}, Point{0, 1}, Point{1, 1}}) {
        canvas.text({at.x + shift.x, at.y + shift.y}, words, face, palette::with_alpha(palette::black, 190),
                    align, room);
    }
    return canvas.text(at, words, face, ink, align, room);
}

/// The radiation symbol (ISO 361): disc of radius 1, blades of 60° from 1.5 to 5.
void trefoil(Canvas& canvas, Point centre, float radius) {
    constexpr float pi = std::numbers::pi_v<float>;
    canvas.box({centre.x - 1.3f * radius, centre.y - 1.3f * radius, centre.x + 1.3f * radius,
                centre.y + 1.3f * radius},
               palette::beam, 0.3f * radius);
    for (float middle : {pi / 2.0f, pi * 7.0f / 6.0f, pi * 11.0f / 6.0f}) {
        canvas.sector(centre, radius, middle - pi / 6.0f, middle + pi / 6.0f, palette::black);
    }
    canvas.disc(centre, 0.30f * radius, palette::beam);
    canvas.disc(centre, 0.20f * radius, palette::black);
}

void draw_status(Canvas& canvas, const Box& area, const Readout& r) {
    const float right = area.right - 14.0f, top = area.top + 12.0f;
    const Face face = Face::Title;
    if (!r.beam_on) {
        marked(canvas, {right, top}, "LIH", face, palette::value, Align::Right);
        return;
    }
    const float width = marked(canvas, {right, top}, "LIVE", face, palette::beam, Align::Right);
    trefoil(canvas, {right - width - 26.0f, top + 0.5f * canvas.text_height(face)}, 11.0f);
}

ImageMarks marks_of(const Readout& r) {
    return r.image.value_or(
        ImageMarks{r.mode, r.lao, r.cranial, r.pulse_rate, r.sid, r.field_of_view, r.frame, r.time});
}

}  // namespace

void draw_image_marks(Canvas& canvas, const Box& area, const Readout& r) {
    constexpr float inset = 14.0f;
    const float middle = 0.5f * (area.left + area.right), height = area.bottom - area.top,
                half = 0.5f * (area.right - area.left) - 40.0f;
    marked(canvas, {area.left + inset, area.top + 10.0f}, r.title, Face::Bold, palette::value, Align::Left,
           half);
    const ImageMarks m = marks_of(r);
    std::string mode = m.mode;
    if (is_known(m.pulse_rate)) mode += " " + rate_text(m.pulse_rate) + " p/s";
    marked(canvas, {area.left + inset, area.top + 28.0f}, mode, Face::Title, palette::bright, Align::Left,
           half);
    marked(canvas, {area.left + inset, area.top + 54.0f}, mask_shift_text(m.mask_x, m.mask_y), Face::Plain,
           palette::value, Align::Left, half);
    draw_status(canvas, area, r);
    if (is_known(r.breath_held))
        marked(canvas, {area.right - inset, area.top + 40.0f},
               "breath held " + figure_text(r.breath_held, 0) + " s", Face::Plain, palette::value,
               Align::Right);

    const ImageSides sides = image_sides(m.lao, m.cranial);
    const float level = area.top + 0.5f * height - 10.0f;
    marked(canvas, {area.left + inset, level}, sides.left, Face::Title, palette::bright);
    marked(canvas, {area.right - inset, level}, sides.right, Face::Title, palette::bright, Align::Right);
    marked(canvas, {middle, area.top + 10.0f}, sides.top, Face::Title, palette::bright, Align::Centre);

    const float upper = area.bottom - 46.0f, lower = area.bottom - 25.0f;
    marked(canvas, {area.left + inset, upper},
           primary_angle_text(m.lao) + "   " + secondary_angle_text(m.cranial), Face::Figure,
           palette::bright);
    marked(canvas, {area.left + inset, lower},
           "SID " + centimetre_text(m.sid) + " cm   FD " + centimetre_text(m.field_of_view) + " cm",
           Face::Plain, palette::value);
    marked(canvas, {area.right - inset, upper}, clock_text(m.time), Face::Figure, palette::bright,
           Align::Right);
    marked(canvas, {area.right - inset, lower}, "image " + std::to_string(m.frame), Face::Plain,
           palette::value, Align::Right);
}

}  // namespace render

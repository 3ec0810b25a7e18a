#include "render/panel/c_arm_pictogram.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/panel/palette.h"

namespace render {

namespace {

constexpr Ink body{70, 82, 90};

std::array<Point, 32> ellipse(Point centre, float a, float b) {
    std::array<Point, 32> points;
    for (std::size_t k = 0; k < points.size(); ++k) {
        const float angle = 2.0f * half_turn * static_cast<float>(k) / static_cast<float>(points.size());
        points[k] = {centre.x + a * std::cos(angle), centre.y + b * std::sin(angle)};
    }
    return points;
}

void patient_from_feet(Canvas& canvas, Point iso) {
    for (float side : {-1.0f, 1.0f}) canvas.disc({iso.x + side * 18.5f, iso.y + 2.0f}, 3.5f, body);
    canvas.polygon(ellipse(iso, 15.0f, 8.5f), body);
    canvas.box({iso.x - 23.0f, iso.y + 9.0f, iso.x + 23.0f, iso.y + 11.0f}, palette::faint);
}

/// As the operator sees the patient from the right: head to the left.
void patient_from_right(Canvas& canvas, Point iso) {
    canvas.disc({iso.x - 31.0f, iso.y + 1.5f}, 6.0f, body);
    canvas.box({iso.x - 24.0f, iso.y - 6.0f, iso.x + 20.0f, iso.y + 8.0f}, body, 6.0f);
    canvas.box({iso.x + 10.0f, iso.y - 2.0f, iso.x + 50.0f, iso.y + 8.0f}, body, 4.0f);
    canvas.box({iso.x - 40.0f, iso.y + 9.0f, iso.x + 50.0f, iso.y + 11.0f}, palette::faint);
}

/// `tilt` turns the detector from straight up, clockwise on the sheet [rad]; `lift` is its distance from the
/// isocentre relative to that of the source.
void stand(Canvas& canvas, Point iso, float tilt, float lift, bool beam_on) {
    constexpr float radius = 40.0f;
    const Point up{std::sin(tilt), -std::cos(tilt)}, across{-up.y, up.x};
    const auto place = [&](float along, float aside) {
        return Point{iso.x + along * up.x + aside * across.x, iso.y + along * up.y + aside * across.y};
    };
    const auto block = [&](float along, float depth, float half_width, Ink ink) {
        canvas.polygon(std::array{place(along + depth, -half_width), place(along + depth, half_width),
                                  place(along, half_width), place(along, -half_width)},
                       ink);
    };
    const float face = radius * lift;
    constexpr float half_detector = 11.0f;
    canvas.polygon(
        std::array{place(-radius, 0.0f), place(face, -half_detector), place(face, half_detector)},
        beam_on ? palette::with_alpha(palette::beam, 105) : palette::with_alpha(palette::label, 38));
    // From the source around the left to the column of the detector.
    const float top = tilt - 0.5f * half_turn;
    canvas.arc(iso, radius + 2.0f, top - half_turn, top, palette::label, 3.5f);
    canvas.line(place(radius + 2.0f, 0.0f), place(face + 3.0f, 0.0f), palette::label, 4.0f);
    block(face, 5.0f, half_detector, palette::value);
    block(-radius - 6.0f, 8.0f, 5.5f, beam_on ? palette::beam : palette::value);
}

}  // namespace

void draw_c_arm(Canvas& canvas, const Box& area, CArmView view, double angle, double lift, bool beam_on) {
    canvas.box(area, palette::well, 4.0f);
    const Point iso{0.5f * (area.left + area.right), 0.5f * (area.top + area.bottom) - 1.0f};
    const bool from_feet = view == CArmView::FromFeet;
    (from_feet ? patient_from_feet : patient_from_right)(canvas, iso);
    if (!std::isfinite(angle)) return;
    const auto tilt = static_cast<float>(std::remainder(from_feet ? angle : -angle, 2.0 * std::numbers::pi));
    stand(canvas, iso, tilt, lift >= 0.3 ? static_cast<float>(std::min(lift, 0.85)) : 0.3f, beam_on);
}

}  // namespace render

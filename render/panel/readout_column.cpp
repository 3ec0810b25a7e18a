#include "render/panel/readout_column.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/panel/canvas.h"
#include "render/panel/palette.h"

namespace render {
namespace {

enum class CArmView {
    FromFeet,  // rotation: LAO turns the detector to the right of the sheet
    FromRight  // angulation, head to the left: cranial turns the detector to the left
};

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

/// `angle` of rotation or angulation, LAO and cranial positive [rad]; with one that is not finite the patient
/// is drawn without an arm. `lift`: distance of the detector from the isocentre, relative to that of the
/// source; clamped to what can be drawn.
void draw_c_arm(Canvas& canvas, const Box& area, CArmView view, double angle, double lift, bool beam_on) {
    canvas.box(area, palette::well, 4.0f);
    const Point iso{0.5f * (area.left + area.right), 0.5f * (area.top + area.bottom) - 1.0f};
    const bool from_feet = view == CArmView::FromFeet;
    (from_feet ? patient_from_feet : patient_from_right)(canvas, iso);
    if (!std::isfinite(angle)) return;
    const auto tilt = static_cast<float>(std::remainder(from_feet ? angle : -angle, 2.0 * std::numbers::pi));
    stand(canvas, iso, tilt, lift >= 0.3 ? static_cast<float>(std::min(lift, 0.85)) : 0.3f, beam_on);
}

constexpr float margin = 12.0f;
constexpr float heading_height = 20.0f;

/// value / full, 0 when either is missing.
float fraction_of(std::optional<double> value, std::optional<double> full) {
    if (!is_known(value) || !is_known(full) || *full <= 0.0) return 0.0f;
    return static_cast<float>(std::clamp(*value / *full, 0.0, 10.0));
}

/// Amber from half of the tolerated value, red from all of it.
Ink level_ink(float fraction) {
    if (fraction >= 1.0f) return palette::alarm;
    return fraction >= 0.5f ? palette::caution : palette::calm;
}

std::optional<double> times(std::optional<double> value, double factor) {
    if (value) *value *= factor;
    return value;
}

std::string signed_text(std::optional<double> value, int decimals) {
    const std::string text = figure_text(value, decimals);
    return is_known(value) && *value > 0.0 ? "+" + text : text;
}

/// Returns the upper edge of the content. `note` stands at the right end of the line.
float heading(Canvas& canvas, const Box& area, std::string_view name, std::string_view note = {},
              Ink note_ink = palette::value) {
    canvas.line({area.left, area.top + 0.5f}, {area.right, area.top + 0.5f}, palette::rule);
    const float width = canvas.text({area.left, area.top + 5.0f}, name, Face::Small, palette::label);
    canvas.text({area.right, area.top + 5.0f}, note, Face::Small, note_ink, Align::Right,
                area.right - area.left - width - 12.0f);
    return area.top + heading_height;
}

void row(Canvas& canvas, const Box& area, float top, std::string_view name, std::string_view value,
         Ink ink = palette::value) {
    canvas.name({area.left, top}, name, palette::label);
    canvas.text({area.right, top}, value, Face::Plain, ink, Align::Right, 0.66f * (area.right - area.left));
}

void bar(Canvas& canvas, const Box& area, float top, float fraction, Ink ink) {
    constexpr float height = 5.0f;
    canvas.box({area.left, top, area.right, top + height}, palette::well, 2.0f);
    canvas.frame({area.left, top, area.right, top + height}, palette::rule, 2.0f);
    const float width = (area.right - area.left - 2.0f) * std::min(fraction, 1.0f);
    if (width >= 1.0f) {
        canvas.box({area.left + 1.0f, top + 1.0f, area.left + 1.0f + width, top + height - 1.0f}, ink, 1.0f);
    }
}

void draw_gantry(Canvas& canvas, const Box& area, const Readout& r) {
    const float top = heading(canvas, area, "C-ARM"), middle = 0.5f * (area.left + area.right);
    constexpr float height = 102.0f, gap = 4.0f;
    const Box axial{area.left, top, middle - gap, top + height},
        sagittal{middle + gap, top, area.right, top + height};
    const double lift = is_known(r.sid) && is_known(r.sod) ? (*r.sid - *r.sod) / *r.sod : 0.5;
    draw_c_arm(canvas, axial, CArmView::FromFeet, r.lao, lift, r.beam_on);
    draw_c_arm(canvas, sagittal, CArmView::FromRight, r.cranial, lift, r.beam_on);
    const float angles = top + height + 3.0f;
    for (const auto& [box, text] : {std::pair{axial, primary_angle_text(r.lao)},
                                    std::pair{sagittal, secondary_angle_text(r.cranial)}}) {
        canvas.text({0.5f * (box.left + box.right), angles}, text, Face::Figure, palette::bright,
                    Align::Centre);
    }
    const float first = angles + 22.0f, second = first + 17.0f;
    const auto distance = [&](float fraction, std::string_view name, std::optional<double> length) {
        const Point at{area.left + fraction * (area.right - area.left), first};
        const float after = at.x + canvas.text(at, name, Face::Plain, palette::label) + 5.0f;
        canvas.text({after, first}, centimetre_text(length) + " cm", Face::Plain, palette::value);
    };
    distance(0.0f, "SID", r.sid);
    distance(0.365f, "SOD", r.sod);
    distance(0.72f, "FD", r.field_of_view);
    std::string table = "--";
    if (r.table) {
        table = centimetre_text(r.table->longitudinal) + " / " + centimetre_text(r.table->lateral) + " / " +
                centimetre_text(r.table->height);
    }
    row(canvas, area, second, "Table", table + " cm");
}

void draw_technique(Canvas& canvas, const Box& area, const Readout& r) {
    const float top =
        heading(canvas, area, "X-RAY", r.beam_on ? "ON" : "OFF", r.beam_on ? palette::beam : palette::faint);
    const Ink ink = r.beam_on ? palette::bright : palette::value;
    const auto tile = [&](float fraction, float y, const std::string& figure, std::string_view unit) {
        const float x = area.left + fraction * (area.right - area.left);
        const float width = canvas.text({x, y}, figure, Face::Figure, ink);
        canvas.text({x + width + 3.0f, y + 5.0f}, unit, Face::Small, palette::label);
    };
    constexpr float second = 26.0f;
    tile(0.0f, top, figure_text(r.tube_voltage, 0), "kV");
    tile(0.35f, top, figure_text(r.tube_current, 0), "mA");
    tile(0.70f, top, figure_text(r.pulse_width, 1), "ms");
    tile(0.0f, top + second, rate_text(r.pulse_rate), "p/s");
    tile(0.35f, top + second, figure_text(r.detector_dose, 0), "nGy/pulse at detector");
}

void draw_dose(Canvas& canvas, const Box& area, const Readout& r) {
    float y = heading(canvas, area, "DOSE", dose_text(r.air_kerma_rate) + " mGy/min",
                      r.beam_on ? palette::beam : palette::label);
    const auto entry = [&](std::string_view name, const std::string& text, std::optional<double> value,
                           double level) {
        const float fraction = fraction_of(value, level);
        row(canvas, area, y, name, text, fraction >= 0.5f ? level_ink(fraction) : palette::value);
        bar(canvas, area, y + 18.0f, fraction, level_ink(fraction));
        y += 28.0f;
    };
    entry("K_a,r", dose_text(r.air_kerma) + " mGy", r.air_kerma, DoseNotification::air_kerma);
    entry("P_KA", dose_text(r.kerma_area) + " Gy·cm²", r.kerma_area, DoseNotification::kerma_area);
    entry("Fluoro time", clock_text(r.fluoro_time), r.fluoro_time, DoseNotification::fluoro_time);
}

void twist_dial(Canvas& canvas, Point centre, float radius, std::optional<double> twist) {
    canvas.disc(centre, radius, palette::well);
    canvas.ring(centre, radius, palette::rule, 1.5f);
    const auto at = [&](float angle, float r) {
        return Point{centre.x + r * std::sin(angle), centre.y - r * std::cos(angle)};
    };
    for (int k = 0; k < 8; ++k) {
        const float angle = 0.25f * half_turn * static_cast<float>(k);
        canvas.line(at(angle, radius - (k % 2 == 0 ? 6.0f : 3.0f)), at(angle, radius - 1.0f), palette::faint);
    }
    if (!is_known(twist)) return;
    const auto angle = static_cast<float>(std::remainder(*twist, 2.0 * std::numbers::pi));
    canvas.arc(centre, radius - 3.0f, -0.5f * half_turn + std::min(angle, 0.0f),
               -0.5f * half_turn + std::max(angle, 0.0f), palette::calm, 3.0f);
    canvas.line(centre, at(angle, radius - 7.0f), palette::bright, 2.0f);
    canvas.disc(centre, 3.0f, palette::bright);
}

/// At most `most` values, each the largest of its fraction of the history; NaN where none is finite.
std::vector<double> peaks(const std::vector<double>& history, std::size_t most) {
    std::vector<double> result(std::min(history.size(), most), std::nan(""));
    for (std::size_t k = 0; k < history.size(); ++k) {
        double& peak = result[k * result.size() / history.size()];
        if (std::isfinite(history[k]) && !(history[k] <= peak)) peak = history[k];
    }
    return result;
}

/// The values over the width, between two levels; a gap where one is not finite.
void curve(Canvas& canvas, const Box& area, const std::vector<double>& values, double low, double high,
           Ink ink) {
    std::vector<Point> run;
    const auto stroke = [&] {
        if (run.size() > 1) canvas.path(run, ink, 1.5f);
        run.clear();
    };
    for (std::size_t k = 0; k < values.size(); ++k) {
        if (!std::isfinite(values[k])) {
            stroke();
            continue;
        }
        const float x =
            static_cast<float>(k) / static_cast<float>(std::max<std::size_t>(values.size() - 1, 1));
        const float y = std::min(fraction_of(values[k] - low, high - low), 1.0f);
        run.push_back({area.left + 2.0f + x * (area.right - area.left - 4.0f),
                       area.bottom - 2.0f - y * (area.bottom - area.top - 4.0f)});
    }
    stroke();
}

void force_trace(Canvas& canvas, const Box& area, const Readout& r) {
    canvas.box(area, palette::well, 2.0f);
    canvas.frame(area, palette::rule, 2.0f);
    canvas.text({area.right - 4.0f, area.top + 2.0f}, "last " + figure_text(r.history_length, 0) + " s",
                Face::Small, palette::faint, Align::Right);
    canvas.clip(area);
    curve(canvas, {area.left, area.top + 1.0f, area.right, area.bottom - 1.0f}, peaks(r.force_history, 230),
          0, r.force_limit, palette::calm);
    canvas.unclip();
}

std::string capitals(std::string text) {
    for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return text;
}

constexpr double bow_seen = 1.0;  // what a hand has fed in vain is marked from here on [mm]

void draw_devices(Canvas& canvas, const Box& area, const Readout& r) {
    // Of the device in the right hand, or in the left one where that is empty; of the first where it holds
    // all. The others' lengths stand beside the heading.
    const std::string& held = r.held.empty() ? r.left_hand : r.held;
    std::size_t shown = 0;
    std::string title, others;
    for (std::size_t k = 0; k < r.devices.size(); ++k)
        if (r.devices[k].name == held) shown = k;
    for (std::size_t k = 0; k < r.devices.size(); ++k) {
        if (k == shown || held == "all") title += (title.empty() ? "" : " + ") + capitals(r.devices[k].name);
        if (k != shown)
            others += (others.empty() ? "" : ", ") + r.devices[k].name + " " +
                      figure_text(r.devices[k].inserted, 0) + " mm";
    }
    if (title.empty()) title = "WIRE";
    float y = heading(canvas, area, title, others, palette::value);
    const Readout::Device device = r.devices.empty() ? Readout::Device() : r.devices[shown];
    const std::optional<double> length = device.inserted, whole = device.length, twist = device.hub_twist;
    std::string inserted = figure_text(length, 0);
    if (is_known(whole)) inserted += " / " + figure_text(whole, 0);
    row(canvas, area, y, "Inserted", inserted + " mm");
    bar(canvas, area, y + 18.0f, fraction_of(length, whole), palette::calm);
    y += 28.0f;
    if (is_known(r.tip_to_target)) {
        row(canvas, area, y, "Tip to target", figure_text(r.tip_to_target, 1) + " mm");
        y += 21.0f;
    }

    constexpr float radius = 27.0f;
    twist_dial(canvas, {area.left + radius + 1.0f, y + radius}, radius, twist);
    const Box beside{area.left + 2.0f * radius + 16.0f, 0, area.right, 0};
    row(canvas, beside, y, "Twist", signed_text(times(twist, 180.0 / std::numbers::pi), 0) + "°");
    row(canvas, beside, y + 19.0f, "Torque", signed_text(device.torque, 2) + " N·mm");
    row(canvas, beside, y + 38.0f, "Push", signed_text(device.push_force, 2) + " N");
    y += 2.0f * radius + 7.0f;
    row(canvas, area, y, "Hand at",
        figure_text(device.grip, 0) + " mm, bow " + figure_text(device.bow, 1) + " mm",
        device.bow && *device.bow >= bow_seen ? palette::caution : palette::value);
    y += 19.0f;

    const auto force = [&](std::string_view name, std::optional<double> value) {
        const float fraction = fraction_of(value, r.force_limit);
        canvas.name({area.left, y}, name, palette::label);
        bar(canvas, {area.left + 84.0f, 0, area.right - 58.0f, 0}, y + 5.0f, fraction, level_ink(fraction));
        canvas.text({area.right, y}, figure_text(value, 2) + " N", Face::Plain,
                    fraction >= 0.5f ? level_ink(fraction) : palette::value, Align::Right, 54.0f);
        y += 18.0f;
    };
    force("Tip force", r.tip_force);
    force("Wall, max.", r.largest_wall_force);
    force_trace(canvas, {area.left, y + 3.0f, area.right, y + 33.0f}, r);
}

void draw_contrast(Canvas& canvas, const Box& area, const Readout& r) {
    const bool injecting = r.injection_rate > 0.0;
    const float y =
        heading(canvas, area, "CONTRAST",
                injecting ? "INJECTING " + figure_text(r.injection_rate, 1) + " ml/s" : "", palette::caution);
    const float fraction = fraction_of(r.contrast, r.contrast_limit);
    std::string given = figure_text(r.contrast, 1);
    if (is_known(r.contrast_limit)) given += " / " + figure_text(r.contrast_limit, 0);
    row(canvas, area, y, "Given", given + " ml", fraction >= 0.5f ? level_ink(fraction) : palette::value);
    bar(canvas, area, y + 18.0f, fraction, level_ink(fraction));
}

/// Amber beyond the nominal pressure, red beyond the rated one, at which the bar is full.
void draw_balloon(Canvas& canvas, const Box& area, const Readout& r) {
    const Readout::Balloon& b = *r.balloon;
    float y = heading(canvas, area, b.stent ? "STENT" : "BALLOON", b.title);
    if (b.pressure) {
        const bool beyond = *b.pressure > b.rated.value_or(0);
        const Ink ink = b.burst || beyond                         ? palette::alarm
                        : *b.pressure > b.nominal.value_or(0) + 1 ? palette::caution
                                                                  : palette::calm;
        canvas.text({area.left, y}, inflation_text(b), Face::Plain, b.burst || beyond ? ink : palette::value,
                    Align::Left, area.right - area.left);
        bar(canvas, area, y + 18.0f, fraction_of(b.pressure, b.rated), ink);
        y += 28.0f;
        row(canvas, area, y, "Width", balloon_width_text(b));
        row(canvas, area, y + 17.0f, "Inflated", clock_text(b.seconds));
        y += 34.0f;
    }
    if (b.stent)
        canvas.text({area.left, y}, stent_text(b), Face::Plain, palette::value, Align::Left,
                    area.right - area.left);
}

float balloon_height(const Readout::Balloon& b) {
    return heading_height + 8.0f + (b.pressure ? 62.0f : 0.0f) + (b.stent ? 17.0f : 0.0f);
}

constexpr float pressure_text_height = 26.0f, pressure_height = 130.0f;  // without curves, with them

/// A line of numbers, and where there is room for them the pressure now and the curves of the last 4 s.
void draw_pressure(Canvas& canvas, const Box& area, const Readout& r) {
    const float y = heading(canvas, area, "PRESSURE",
                            pressure_text(r) + " mmHg, " + figure_text(r.heart_rate, 0) + "/min");
    if (area.bottom - area.top < pressure_height - 8.0f) return;
    row(canvas, area, y, capitals(r.pressure_of.substr(0, 1)) + r.pressure_of.substr(1),
        figure_text(r.pressure, 0) + " mmHg");
    const Box well{area.left, y + 20.0f, area.right, y + 104.0f};
    canvas.box(well, palette::well, 2.0f);
    canvas.frame(well, palette::rule, 2.0f);
    canvas.clip(well);
    const double highest = pressure_scale(r);
    curve(canvas, {well.left, well.top, well.right, well.top + 30.0f}, r.ecg_history, ecg_low, ecg_high,
          palette::good);
    curve(canvas, {well.left, well.top + 30.0f, well.right, well.bottom}, r.pressure_history, 0, highest,
          palette::alarm);
    canvas.text({well.right - 4.0f, well.bottom - 14.0f},
                "last 4 s, 0 to " + figure_text(highest, 0) + " mmHg", Face::Small, palette::faint,
                Align::Right);
    canvas.unclip();
}

/// Breaks the text at spaces into lines of at most `room`; a longer word has a line of its own.
std::vector<std::string> wrapped(const Canvas& canvas, std::string_view text, Face face, float room) {
    std::vector<std::string> lines;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find(' '), text.size());
        const std::string_view word = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        if (word.empty()) continue;
        if (!lines.empty() && canvas.text_width(lines.back() + " " + std::string(word), face) <= room) {
            lines.back().append(" ").append(word);
        } else {
            lines.emplace_back(word);
        }
    }
    return lines;
}

Ink notice_ink(Notice notice) {
    return notice == Notice::Success   ? palette::good
           : notice == Notice::Warning ? palette::caution
           : notice == Notice::Alarm   ? palette::alarm
                                       : palette::calm;
}

void draw_messages(Canvas& canvas, const Box& area, const Readout& r) {
    const float top = heading(canvas, area, "MESSAGES");
    constexpr float step = 16.0f, gap = 3.0f, indent = 10.0f;
    // From the newest upward, as many as there is room for.
    std::vector<std::vector<std::string>> shown;
    float left = area.bottom - top;
    for (auto message = r.messages.rbegin(); message != r.messages.rend(); ++message) {
        auto lines = wrapped(canvas, message->text, Face::Plain, area.right - area.left - indent);
        left -= step * static_cast<float>(lines.size()) + gap;
        if (left < 0.0f && !shown.empty()) break;
        shown.push_back(std::move(lines));
    }
    float y = top;
    for (std::size_t k = shown.size(); k-- > 0;) {
        const Notice notice = r.messages[r.messages.size() - 1 - k].notice;
        const float height = step * static_cast<float>(shown[k].size());
        canvas.box({area.left, y + 1.0f, area.left + 3.0f, y + height - 1.0f}, notice_ink(notice));
        for (const std::string& line : shown[k]) {
            canvas.text({area.left + indent, y}, line, Face::Plain,
                        notice == Notice::Info ? palette::value : notice_ink(notice), Align::Left,
                        area.right - area.left - indent);
            y += step;
        }
        y += gap;
    }
}

struct Section {
    void (*draw)(Canvas&, const Box&, const Readout&);
    float height;  // the last takes the remainder
};
constexpr Section sections[] = {{draw_gantry, 190.0f},
                                {draw_technique, 76.0f},
                                {draw_dose, 108.0f},
                                {draw_devices, 231.0f},
                                {draw_balloon, 0.0f},
                                {draw_contrast, 52.0f},
                                {draw_pressure, pressure_text_height},
                                {draw_messages, 0.0f}};

}  // namespace

void draw_readouts(Canvas& canvas, const Box& area, const Readout& readout) {
    float top = area.top;
    for (const Section& section : sections) {
        float height = section.height;
        if (section.draw == draw_balloon) {
            if (!readout.balloon) continue;
            height = balloon_height(*readout.balloon);
        }
        if (section.draw == draw_pressure) {
            if (readout.pressure_of.empty()) continue;
            constexpr float for_messages = 100.0f;
            if (top + pressure_height + for_messages <= area.bottom) height = pressure_height;
        }
        const float bottom = height > 0.0f ? top + height : area.bottom;
        canvas.clip({area.left, top, area.right, bottom});
        section.draw(canvas, {area.left + margin, top, area.right - margin, bottom - 4.0f}, readout);
        canvas.unclip();
        top = bottom;
    }
}

}  // namespace render

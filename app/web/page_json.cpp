#include "app/web/page_json.h"

#include <array>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <string_view>

#include "engine/exercise/grade.h"
#include "engine/room/words.h"
#include "engine/script/command.h"

namespace app {

Json number(std::optional<double> value) {
    return render::is_known(value) ? Json(*value) : Json();
}

namespace {

constexpr std::array<const char*, 4> notices = {"info", "success", "warning", "alarm"};

std::string with_unit(std::optional<double> value, int decimals, const char* unit) {
    return render::figure_text(value, decimals) + " " + unit;
}

Json rows(std::initializer_list<std::pair<std::string, std::string>> all) {
    Json made = Json::array();
    for (const auto& [name, value] : all) made.push_back({name, value});
    return made;
}

Json devices_of(const render::Readout& r) {
    Json made = Json::array();
    for (const render::Readout::Device& d : r.devices) {
        const std::optional<double> twist =
            d.hub_twist ? std::optional(*d.hub_twist * 180 / std::numbers::pi) : std::nullopt;
        made.push_back({{"name", d.name},
                        {"inserted", render::figure_text(d.inserted, 0) +
                                         (d.length ? " / " + render::figure_text(d.length, 0) : "") + " mm"},
                        {"fraction", d.inserted && d.length ? number(*d.inserted / *d.length) : Json()},
                        {"twist", render::figure_text(twist, 0) + "°"},
                        {"twistDegrees", number(twist)},
                        {"torque", with_unit(d.torque, 2, "N·mm")},
                        {"push", with_unit(d.push_force, 2, "N")},
                        {"grip", with_unit(d.grip, 0, "mm")},
                        {"bow", with_unit(d.bow, 1, "mm")}});
    }
    return made;
}

/// Its rows, and how far its bar goes: 1 at the rated pressure.
Json balloon_of(const render::Readout::Balloon& b) {
    Json lines = Json::array();
    if (b.pressure) {
        lines.push_back({"Balloon", render::inflation_text(b)});
        lines.push_back({"Width", render::balloon_width_text(b)});
        lines.push_back({"Inflated", render::clock_text(b.seconds)});
    }
    if (b.stent) lines.push_back({"Stent", render::stent_text(b)});
    return {{"title", b.stent ? "Stent" : "Balloon"},
            {"device", b.title},
            {"rows", lines},
            {"burst", b.burst},
            {"isStent", b.stent.has_value()},
            {"fraction", b.pressure && b.rated ? number(*b.pressure / *b.rated) : Json()},
            {"nominal", b.nominal && b.rated ? number(*b.nominal / *b.rated) : Json()}};
}

/// Of the last seconds, and the ends of their scales.
Json curves_of(const render::Readout& r) {
    const auto curve = [](const std::vector<double>& values, double low, double high) {
        Json made = Json::array();
        for (const double value : values) made.push_back(number(value));
        return Json{{"values", made}, {"low", low}, {"high", high}};
    };
    return {{"pressure", curve(r.pressure_history, 0, render::pressure_scale(r))},
            {"ecg", curve(r.ecg_history, render::ecg_low, render::ecg_high)}};
}

Json marks_of(const render::Readout& r) {
    const render::ImageMarks at =
        r.image.value_or(render::ImageMarks{r.mode, r.lao, r.cranial, {}, {}, {}, r.frame, {}});
    return {{"mode", at.mode},
            {"angles", render::primary_angle_text(at.lao) + "  " + render::secondary_angle_text(at.cranial)},
            {"mask", render::mask_shift_text(at.mask_x, at.mask_y)},
            {"frame", at.frame}};
}

}  // namespace

Json readout_of(const render::Readout& r) {
    Json messages = Json::array();
    for (const render::Message& message : r.messages)
        messages.push_back(
            {{"text", message.text}, {"notice", notices[static_cast<std::size_t>(message.notice)]}});
    const render::ImageMarks* at = r.image ? &*r.image : nullptr;
    const render::ImageSides sides = render::image_sides(at ? at->lao : r.lao, at ? at->cranial : r.cranial);
    Json history = Json::array();
    for (const double force : r.force_history) history.push_back(number(force));
    std::string table = "--";
    if (r.table)
        table =
            fmt::format("{} / {} / {} cm", render::centimetre_text(r.table->longitudinal),
                        render::centimetre_text(r.table->lateral), render::centimetre_text(r.table->height));
    Json made = {
        {"mode", r.mode},
        {"beamOn", r.beam_on},
        {"messages", messages},
        {"sides", {{"left", sides.left}, {"right", sides.right}, {"top", sides.top}}},
        {"groups",
         {{{"title", "C-arm"},
           {"rows", rows({{render::primary_angle_text(r.lao), render::secondary_angle_text(r.cranial)},
                          {"SID", render::centimetre_text(r.sid) + " cm"},
                          {"SOD", render::centimetre_text(r.sod) + " cm"},
                          {"Field", render::centimetre_text(r.field_of_view) + " cm"},
                          {"Table", table}})}},
          {{"title", "X-ray"},
           {"rows",
            rows({{"Tube", with_unit(r.tube_voltage, 0, "kV") + ", " + with_unit(r.tube_current, 0, "mA")},
                  {"Pulse",
                   with_unit(r.pulse_width, 1, "ms") + ", " + render::rate_text(r.pulse_rate) + " p/s"},
                  {"At detector", with_unit(r.detector_dose, 0, "nGy/pulse")}})}},
          {{"title", "Dose"},
           {"rows", rows({{"K_a,r", render::dose_text(r.air_kerma) + " mGy"},
                          {"Rate", render::dose_text(r.air_kerma_rate) + " mGy/min"},
                          {"P_KA", render::dose_text(r.kerma_area) + " Gy·cm²"},
                          {"Fluoro time", render::clock_text(r.fluoro_time)}})}},
          {{"title", "Contrast"},
           {"rows",
            rows({{"Given", render::figure_text(r.contrast, 1) +
                                (r.contrast_limit ? " / " + render::figure_text(r.contrast_limit, 0) : "") +
                                " ml"},
                  {"Rate", r.injection_rate > 0 ? with_unit(r.injection_rate, 1, "ml/s") : "--"}})}}}},
        {"devices", devices_of(r)},
        {"held", r.held},
        {"leftHand", r.left_hand},
        {"helper", r.helper},
        {"force",
         {{"wall", number(r.largest_wall_force)},
          {"tip", number(r.tip_force)},
          {"limit", r.force_limit},
          {"history", history}}},
        {"injecting", r.injection_rate},
        {"breathHeld", number(r.breath_held)},
        {"tipToTarget", number(r.tip_to_target)},
        {"lao", number(r.lao)},
        {"cranial", number(r.cranial)},
        {"mmPerImage",
         r.field_of_view && r.sod && r.sid ? number(*r.field_of_view * *r.sod / *r.sid) : Json()},
        {"marks", marks_of(r)}};
    if (r.balloon) made["balloon"] = balloon_of(*r.balloon);
    if (!r.pressure_of.empty()) {
        made["curves"] = curves_of(r);
        made["groups"].push_back(
            {{"title", "Pressure"},
             {"rows", rows({{"Of the " + r.pressure_of, render::pressure_text(r) + " mmHg"},
                            {"Now", with_unit(r.pressure, 0, "mmHg")},
                            {"Heart", with_unit(r.heart_rate, 0, "/min")}})}});
    }
    return made;
}

Json guide_of(const room::Guide& guide, const room::KeyMap& keys) {
    Json steps = Json::array();
    for (std::size_t k = 0; k < guide.size(); ++k) {
        Json practices = Json::array();
        const auto& practise = guide.step(k).practise;
        for (std::size_t p = 0; p < practise.size(); ++p)
            practices.push_back({{"text", script::help_of(practise[p])},
                                 {"keys", room::inputs_of(practise[p], keys)},
                                 {"done", guide.is_done(k, p)}});
        steps.push_back(
            {{"title", script::task_names[static_cast<std::size_t>(script::task_of(practise[0]))]},
             {"text", guide.step(k).text},
             {"done", guide.is_done(k)},
             {"skipped", guide.is_skipped(k)},
             {"practices", practices}});
    }
    return {{"step", guide.shown()}, {"done", guide.done()}, {"over", guide.over()}, {"steps", steps}};
}

Json size_of(const std::shared_ptr<const render::GrayImage>& image) {
    return image ? Json{{"width", image->width}, {"height", image->height}} : Json();
}

Json grade_lines(const exercise::Grade& grade) {
    Json made = Json::array();
    for (const exercise::GradeLine& line : grade.lines)
        made.push_back({{"name", line.measure->name},
                        {"own", exercise::own_text(line)},
                        {"skilled", exercise::skilled_text(line)},
                        {"cost", line.cost}});
    if (grade.cost_of_injuries() > 0)
        made.push_back({{"name", "Injuries of the wall"},
                        {"own", std::to_string(grade.dissections + grade.perforations)},
                        {"skilled", ""},
                        {"cost", grade.cost_of_injuries()}});
    return made;
}

Json notes_of(const exercise::Grade& grade, const scenario::Scenario& s) {
    const scenario::Benchmark& skilled = s.lesson.benchmark;
    Json notes = Json::array();
    if (std::ranges::any_of(grade.lines, [](const auto& line) { return line.unseen; }))
        notes.push_back(exercise::blind_advice);
    for (const exercise::GradeLine& line : grade.lines)
        if (line.cost >= 2 && !line.unseen && std::string_view(line.measure->id) != "errors")
            notes.push_back(fmt::format("{}: {}", line.measure->name, line.measure->advice));
    notes.push_back(fmt::format("Skilled: {} attempts{} by {}.", skilled.attempts,
                                s.patient.empty() ? "" : " at the first patient", skilled.by));
    return notes;
}

Json events_of(const room::View& view) {
    Json events = Json::array();
    if (const std::string words = room::teacher_text(view.score); !words.empty())
        events.push_back({{"time", ""}, {"what", words}, {"advice", ""}, {"kind", "teacher"}});
    if (view.events)
        for (const room::LessonEvent& event : *view.events)
            if (event.kind == room::LessonEvent::Kind::Comment)
                events.push_back({{"time", render::clock_text(event.seconds)},
                                  {"what", "The teacher: " + event.what},
                                  {"advice", ""},
                                  {"kind", "teacher"}});
    for (const exercise::HandlingErrorMark& mark : view.score.handling_errors) {
        Json event = {{"time", render::clock_text(mark.start)},
                      {"frame", mark.first},
                      {"what", room::error_text(mark)},
                      {"advice", exercise::handling_error_advice[static_cast<std::size_t>(mark.kind)]},
                      {"kind", "error"}};
        if (const auto [run, image] = room::moment_of(view.runs, mark.first); run)
            event["run"] = run->number, event["image"] = image;
        events.push_back(event);
    }
    for (const exercise::WrongBranch& branch : view.score.wrong_branches)
        events.push_back(
            {{"time", ""}, {"what", room::wrong_branch_text(branch)}, {"advice", ""}, {"kind", "branch"}});
    if (view.score.handling_errors.empty() && view.score.wrong_branches.empty() && view.score.frames > 0)
        events.push_back({{"time", ""}, {"what", room::without_error}, {"advice", ""}, {"kind", "good"}});
    return events;
}

Json runs_of(const room::View& view) {
    Json runs = Json::array();
    for (const auto& run : view.runs)
        runs.push_back({{"number", run->number},
                        {"mode", script::title_of(run->mode)},
                        {"images", run->images.size()},
                        {"rate", run->pulse_rate},
                        {"dsa", run->mode == script::ImagingMode::Dsa}});
    return runs;
}

Json map_of(const room::WayMap& map) {
    const auto point = [](const room::WayMap::Point& p) {
        return Json::array({std::round(10 * p.x) / 10, std::round(10 * p.y) / 10});
    };
    const auto points = [&](const std::vector<room::WayMap::Point>& all) {
        Json made = Json::array();
        for (const room::WayMap::Point& p : all) made.push_back(point(p));
        return made;
    };
    Json vessels = Json::array();
    for (const room::WayMap::Branch& branch : map.vessels) {
        Json radii = Json::array();
        for (const double radius : branch.radii) radii.push_back(std::round(100 * radius) / 100);
        vessels.push_back({{"points", points(branch.points)}, {"radii", radii}});
    }
    return {{"vessels", vessels},          {"way", points(map.way)}, {"start", point(map.start)},
            {"target", point(map.target)}, {"radius", map.radius},   {"low", point(map.low)},
            {"high", point(map.high)},     {"dash", map.dash},       {"gap", map.gap}};
}

}  // namespace app

/// What the window shows: each page of Play, drawn anew each time.

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <imgui.h>
#include <numbers>

#include "app/play/play.h"
#include "app/play/theme.h"
#include "engine/io/text.h"
#include "render/panel/image_marks.h"
#include "render/panel/readout_column.h"
#include "render/picture/png.h"

namespace app {
namespace {

namespace palette = render::palette;
using render::Align;
using render::Box;
using render::Face;
using render::Ink;
using room::Action;
using room::Phase;

constexpr ImGuiWindowFlags bare = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoScrollbar |
                                  ImGuiWindowFlags_NoScrollWithMouse | ImGuiWindowFlags_NoResize |
                                  ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                                  ImGuiWindowFlags_NoSavedSettings;

void text(Ink ink, const std::string& words) {
    ImGui::PushStyleColor(ImGuiCol_Text, tint(ink));
    ImGui::TextUnformatted(words.data(), words.data() + words.size());
    ImGui::PopStyleColor();
}
void wrapped(Ink ink, const std::string& words) {
    ImGui::PushTextWrapPos(0);
    text(ink, words);
    ImGui::PopTextWrapPos();
}

/// A page in the middle, so wide and as high as what is on it; one that was higher than the window can be
/// rolled.
void begin_page(const char* name, float width, float height, float wanted) {
    const float wide = std::min(wanted, 0.96f * width);
    ImGui::SetNextWindowPos(ImVec2(width / 2, height / 2), ImGuiCond_Always, ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSizeConstraints(ImVec2(wide, 0), ImVec2(wide, 0.96f * height));
    ImGui::SetNextWindowBgAlpha(0.97f);
    ImGui::Begin(name, nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                     ImGuiWindowFlags_AlwaysAutoResize);
}

std::string degrees(double radians) {
    return fmt::format("{:.0f}°", radians * 180 / std::numbers::pi);
}

std::string view_text(const render::CArm& arm) {
    return fmt::format("{} {}, {} {}, field {:.0f} mm", arm.lao < 0 ? "RAO" : "LAO",
                       degrees(std::abs(arm.lao)), arm.cranial < 0 ? "caudal" : "cranial",
                       degrees(std::abs(arm.cranial)), arm.detector_width);
}

/// What a trainee reads before the start, a line each.
std::vector<std::pair<std::string, std::string>> briefing(const scenario::Scenario& s) {
    std::vector<std::pair<std::string, std::string>> lines;
    const std::string target = s.target.name.empty() ? "a marked place" : s.target.name;
    lines.emplace_back(
        "Task", fmt::format("Bring the tip to {} (within {:g} mm) and hold it there for {:g} s.", target,
                            s.target.radius, s.target.hold));
    lines.emplace_back("Access", fmt::format("{}, {:.0f} mm of wire inside", s.entry.end, s.entry.inserted));
    lines.emplace_back(
        "Wire", fmt::format("{:.3f} mm, {:.0f} mm long; tip bent by {} over {:.0f} mm", s.guidewire.diameter,
                            s.wire_length, degrees(s.guidewire.curved_angle), s.guidewire.curved_length));
    lines.emplace_back("View", view_text(s.c_arm));
    lines.emplace_back("Contrast", fmt::format("{:.0f} ml at most", s.blood.limit));
    lines.emplace_back("Time", s.time_limit ? fmt::format("{:.0f} s", *s.time_limit) : "no limit");
    return lines;
}

struct Hint {
    Action action;
    const char* words;
};
constexpr Hint hints[] = {
    {Action::Fluoroscopy, "Hold {} for fluoroscopy: the image is live while the pedal is down"},
    {Action::Advance, "{} pushes the wire, the mouse wheel as well; Shift is slower, Ctrl faster"},
    {Action::RotateRight, "{} turns the wire: look for the side that its tip points to"},
    {Action::Acquisition, "Hold {} for a DSA run, and inject with F3 once its mask is taken"},
    {Action::Roadmap, "{} lays the vessels of the last DSA run under the live image"}};

}  // namespace

Texture* Play::thumbnail(std::size_t exercise) {
    std::unique_ptr<Texture>& texture = thumbnails_[exercise];
    if (!texture) {
        texture = std::make_unique<Texture>(window_.gl());
        try {
            texture->show(render::read_png(options_.exercises[exercise].picture), 1);
        } catch (const std::exception&) {
            // A card without a picture.
        }
    }
    return texture.get();
}

void Play::draw_chooser() {
    const float width = static_cast<float>(window_.width()), height = static_cast<float>(window_.height());
    ImGui::SetNextWindowPos(ImVec2(0, 0));
    ImGui::SetNextWindowSize(ImVec2(width, height));
    ImGui::Begin("chooser", nullptr, bare);
    ImGui::PushFont(window_.faces().fonts[static_cast<std::size_t>(Face::Title)]);
    text(palette::bright, "Seldinger");
    ImGui::PopFont();
    text(palette::label, fmt::format("Choose an exercise.   {}: keys   F12: instructor's view",
                                     options_.keys.text(Action::Help)));
    ImGui::Dummy(ImVec2(0, u(6)));
    const float card = u(300), picture = u(200), gap = ImGui::GetStyle().ItemSpacing.x;
    const int columns = std::max(1, static_cast<int>((width - u(24)) / (card + gap)));
    ImGui::BeginChild("cards");
    for (std::size_t k = 0; k < options_.exercises.size(); ++k) {
        const Exercise& exercise = options_.exercises[k];
        if (k % columns != 0) ImGui::SameLine();
        ImGui::PushID(static_cast<int>(k));
        ImGui::BeginChild("card", ImVec2(card, picture + u(158)), true, ImGuiWindowFlags_NoScrollbar);
        const ImVec2 corner = ImGui::GetCursorScreenPos();
        const float side = ImGui::GetContentRegionAvail().x;
        const Texture* shown = thumbnail(k);
        ImGui::Dummy(ImVec2(side, picture));
        ImDrawList& list = *ImGui::GetWindowDrawList();
        list.AddRectFilled(corner, ImVec2(corner.x + side, corner.y + picture), colour(palette::well));
        if (!shown->empty()) {
            // The middle of the picture, as wide as the card.
            const float cut = std::max(0.0f, 1 - picture / side * shown->width() / shown->height()) / 2;
            list.AddImage(shown->id(), corner, ImVec2(corner.x + side, corner.y + picture), ImVec2(0, cut),
                          ImVec2(1, 1 - cut));
        }
        ImGui::PushFont(window_.faces().fonts[static_cast<std::size_t>(Face::Bold)]);
        text(palette::bright, exercise.scenario.name);
        ImGui::PopFont();
        wrapped(palette::value, exercise.scenario.title);
        if (const room::BestResult* best = results_.find(exercise.scenario.name))
            wrapped(palette::good, best->reached == 0
                                       ? fmt::format("tried {} times, not reached yet", best->attempts)
                                       : fmt::format("best {:.0f} points{}, {} of {} reached", best->points,
                                                     best->time ? fmt::format(", {:.1f} s", *best->time) : "",
                                                     best->reached, best->attempts));
        else
            text(palette::faint, "not tried yet");
        ImGui::SetCursorPosY(picture + u(158) - ImGui::GetFrameHeight() - ImGui::GetStyle().WindowPadding.y);
        if (ImGui::Button("Exercise")) open(k, false);
        ImGui::SameLine();
        if (ImGui::Button("Free practice")) open(k, true);
        if (exercise.solution) {
            ImGui::SameLine();
            if (ImGui::Button("Show me")) {
                chosen_ = k;
                play_solution();
            }
        }
        ImGui::EndChild();
        ImGui::PopID();
    }
    ImGui::EndChild();
    ImGui::End();
}

void Play::draw_briefing() {
    const scenario::Scenario& s = session_->options().scenario;
    begin_page("briefing", static_cast<float>(window_.width()), static_cast<float>(window_.height()), u(680));
    ImGui::PushFont(window_.faces().fonts[static_cast<std::size_t>(Face::Title)]);
    wrapped(palette::bright, s.title);
    ImGui::PopFont();
    text(palette::label,
         free_practice_ ? "Free practice: no score, and the last 10 s can be taken back" : "Exercise");
    ImGui::Separator();
    if (ImGui::BeginTable("lines", 2)) {
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, u(80));
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed,
                                ImGui::GetContentRegionAvail().x - u(100));
        for (const auto& [name, words] : briefing(s)) {
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            text(palette::label, name);
            ImGui::TableNextColumn();
            wrapped(palette::value, words);
        }
        ImGui::EndTable();
    }
    ImGui::Dummy(ImVec2(0, u(6)));
    if (view_->phase == Phase::Failed) {
        wrapped(palette::alarm, view_->error);
    } else if (view_->phase == Phase::Loading) {
        text(palette::label, view_->doing.empty() ? "Loading the vessels" : view_->doing);
        ImGui::ProgressBar(static_cast<float>(view_->loading), ImVec2(-1, 0));
    } else {
        text(palette::good, "Ready");
        if (options_.record.empty()) {
            text(palette::faint, "Nothing is recorded; --record FILE does.");
        } else {
            wrapped(palette::faint, fmt::format("Recorded to {}", options_.record.string()));
        }
    }
    ImGui::Dummy(ImVec2(0, u(10)));
    if (view_->phase == Phase::Ready) {
        if (ImGui::IsWindowAppearing() || !ImGui::IsAnyItemFocused()) ImGui::SetKeyboardFocusHere();
        if (ImGui::Button("Start (Enter)") ||
            ImGui::IsKeyPressed(ImGui::GetIO().KeyMap[ImGuiKey_Enter], false)) {
            screen_ = Screen::Room;
            countdown_ = room::Clock::now() + std::chrono::seconds(free_practice_ ? 0 : 3);
        }
        ImGui::SameLine();
    }
    if (ImGui::Button("Back")) leave();
    ImGui::End();
}

void Play::draw_room() {
    const float width = static_cast<float>(window_.width()), height = static_cast<float>(window_.height());
    const float strip = std::round(u(30)), column = std::round(u(render::readout_column_width));
    const float tall = height - strip;
    const float spare = width - column - tall;  // next to a square image
    // The reference screen stands between image and readouts where there is room, else in a corner of the
    // image.
    const float beside = spare >= u(150) ? std::min(spare, tall) : 0;
    const Box image{0, 0, std::max(u(100), std::min(width - column - beside, width - column)), tall};
    draw_image(image);
    if (beside > 0) {
        draw_reference({width - column - beside, 0, width - column, tall});
    } else if (view_->reference) {
        const float side = 0.28f * std::min(image.right, tall);
        draw_reference({image.right - side - u(8), tall - side - u(84), image.right - u(8), tall - u(64)});
    }
    draw_column({width - column, 0, width, tall});
    draw_strip({0, tall, width, height});
    if (instructor_open_ && session_->anatomy()) {
        const auto anatomy = session_->anatomy();
        const scenario::Scenario& s = session_->options().scenario;
        geometry::Vec3 target = s.target.centre.value_or(geometry::Vec3::Zero());
        for (const anatomy::VesselTarget& known : anatomy->targets)
            if (known.name == s.target.name) target = known.centre;
        const std::optional<exercise::Tuning> asked =
            instructor_.draw(*view_, *anatomy, target, s.target.radius,
                             {width * 0.34f, u(10), width - u(10), tall - u(10)}, window_);
        if (asked) session_->give(*asked);
    }
    if (view_->phase == Phase::Failed || view_->phase == Phase::Loading) draw_loading();
    if (!view_) return;  // they left
    draw_hint(image);
    draw_countdown();
}

void Play::draw_loading() {
    begin_page("loading", static_cast<float>(window_.width()), static_cast<float>(window_.height()), u(460));
    if (view_->phase == Phase::Failed) {
        wrapped(palette::alarm, view_->error);
        if (ImGui::Button("Back")) leave();
    } else {
        text(palette::label, view_->doing.empty() ? "Loading the vessels" : view_->doing);
        ImGui::ProgressBar(static_cast<float>(view_->loading), ImVec2(-1, 0));
    }
    ImGui::End();
}

void Play::draw_image(const Box& area) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.AddRectFilled(ImVec2(area.left, area.top), ImVec2(area.right, area.bottom), colour(palette::black));
    const float side = std::floor(std::min(area.right - area.left, area.bottom - area.top));
    const float left = std::round((area.left + area.right - side) / 2),
                top = std::round((area.top + area.bottom - side) / 2);
    if (view_->image) {
        image_.show(*view_->image, view_->image_serial, side < static_cast<float>(view_->image->width));
        list.AddImage(image_.id(), ImVec2(left, top), ImVec2(left + side, top + side));
    }
    render::Canvas marks = canvas();
    const float unit = window_.unit();
    render::draw_image_marks(marks, {left / unit, top / unit, (left + side) / unit, (top + side) / unit},
                             view_->readout);

    // The mouse on the image is a hand on the wire.
    ImGui::SetNextWindowPos(ImVec2(left, top));
    ImGui::SetNextWindowSize(ImVec2(side, side));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
    ImGui::Begin("image", nullptr,
                 bare | ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoBringToFrontOnFocus);
    ImGui::SetCursorPos(ImVec2(0, 0));
    ImGui::InvisibleButton("hand", ImVec2(side, side));
    if (ImGui::IsItemActive() && running()) {
        drag_right_ += ImGui::GetIO().MouseDelta.x;
        drag_up_ -= ImGui::GetIO().MouseDelta.y;
    }
    if (ImGui::IsItemHovered() && ImGui::IsMouseDown(1) && running()) {
        // With the right button the image is moved: the table goes the other way.
        const double per_pixel = view_->readout.field_of_view.value_or(300) *
                                 view_->readout.sod.value_or(750) / view_->readout.sid.value_or(1100) / side;
        table_left_ += ImGui::GetIO().MouseDelta.x * per_pixel;
        table_head_ -= ImGui::GetIO().MouseDelta.y * per_pixel;
    }
    ImGui::End();
    ImGui::PopStyleVar();
}

void Play::draw_reference(const Box& area) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const float unit = window_.unit(), label = u(22);
    const float side = std::floor(std::min(area.right - area.left - u(12), area.bottom - area.top - label));
    if (side < 32) return;
    const float left = area.left + u(6), top = area.top + label;
    list.AddRectFilled(ImVec2(area.left, area.top),
                       ImVec2(area.right, std::min(area.bottom, top + side + u(6))), colour(palette::ground));
    list.AddRectFilled(ImVec2(left, top), ImVec2(left + side, top + side), colour(palette::well));
    render::Canvas sheet = canvas();
    sheet.text({left / unit, (area.top + u(6)) / unit}, "REFERENCE", Face::Small, palette::label);
    if (view_->reference) {
        reference_.show(*view_->reference, reinterpret_cast<std::intptr_t>(view_->reference.get()));
        list.AddImage(reference_.id(), ImVec2(left, top), ImVec2(left + side, top + side));
    } else {
        sheet.text({(left + side / 2) / unit, (top + side / 2) / unit - 8},
                   options_.keys.first(Action::Reference) + " stores the image here", Face::Plain,
                   palette::faint, Align::Centre, side / unit);
    }
    list.AddRect(ImVec2(left, top), ImVec2(left + side, top + side), colour(palette::rule));
}

void Play::draw_column(const Box& area) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.AddRectFilled(ImVec2(area.left, area.top), ImVec2(area.right, area.bottom), colour(palette::ground));
    render::Canvas sheet = canvas({area.left, area.top});
    const float unit = window_.unit();
    const float width = (area.right - area.left) / unit, height = (area.bottom - area.top) / unit;
    render::draw_readouts(sheet, {0, 4, width, height}, view_->readout);

    // The pictograms of the arm can be dragged: rotation on the left one, angulation on the right one.
    ImGui::SetNextWindowPos(ImVec2(area.left, area.top + u(24)));
    ImGui::SetNextWindowSize(ImVec2(area.right - area.left, u(104)));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
    ImGui::Begin("arm", nullptr, bare | ImGuiWindowFlags_NoBackground);
    constexpr double per_pixel = 0.5 * std::numbers::pi / 180;
    for (int k = 0; k < 2; ++k) {
        ImGui::SetCursorPos(ImVec2(k * (area.right - area.left) / 2, 0));
        ImGui::PushID(k);
        ImGui::InvisibleButton("drag", ImVec2((area.right - area.left) / 2, u(104)));
        if (ImGui::IsItemHovered()) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
        if (ImGui::IsItemActive() && running())
            (k == 0 ? arm_lao_ : arm_cranial_) +=
                (k == 0 ? 1 : -1) * per_pixel * ImGui::GetIO().MouseDelta.x / unit;
        ImGui::PopID();
    }
    ImGui::End();
    ImGui::PopStyleVar();
}

void Play::draw_strip(const Box& area) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.AddRectFilled(ImVec2(area.left, area.top), ImVec2(area.right, area.bottom), colour(palette::ground));
    list.AddLine(ImVec2(area.left, area.top), ImVec2(area.right, area.top), colour(palette::rule));
    render::Canvas sheet = canvas({area.left, area.top});
    const render::Readout& r = view_->readout;
    const exercise::Score& score = view_->score;
    float x = 14;
    const auto item = [&](const std::string& name, const std::string& value, Ink ink = palette::value) {
        x += sheet.text({x, 9}, name, Face::Small, palette::label) + 5;
        x += sheet.text({x, 7}, value, Face::Bold, ink) + 18;
    };
    item("TIME", render::clock_text(r.time));
    item("BEAM", fmt::format("{:.0f} s", score.beam_on_time), r.beam_on ? palette::beam : palette::value);
    item("DOSE", fmt::format("{} mGy", render::figure_text(r.air_kerma, 1)));
    const double left = r.contrast_limit.value_or(0) - r.contrast.value_or(0);
    item("CONTRAST", fmt::format("{:.0f} ml", r.contrast.value_or(0)),
         left < 20 ? palette::caution : palette::value);
    item("ERRORS", std::to_string(view_->handling.errors()),
         view_->handling.errors() > 0 ? palette::caution : palette::value);
    if (free_practice_)
        item("FREE PRACTICE", fmt::format("{} taken back", view_->handling.taken_back), palette::calm);
    if (shows_solution_) item("SOLUTION", "your turn comes next", palette::calm);
    if (is_replay_)
        item("REPLAY", view_->differences.empty() ? "as recorded" : "differs",
             view_->differences.empty() ? palette::calm : palette::alarm);
    if (view_->phase == Phase::Paused)
        item("PAUSED", options_.keys.first(Action::Pause) + " goes on", palette::caution);
    if (view_->slow) item("SLOW", "frames are late", palette::alarm);
    const float right = (area.right - area.left) / window_.unit() - 14;
    const std::string record = view_->recording                                        ? "REC"
                               : options_.record.empty() || session_->options().script ? ""
                                                                                       : "NOT RECORDED";
    const float used = sheet.text({right, 9}, record, Face::Small,
                                  view_->recording ? palette::good : palette::alarm, Align::Right);
    sheet.text({right - used - 12, 9},
               fmt::format("{} keys   {} menu", options_.keys.first(Action::Help),
                           options_.keys.first(Action::Menu)),
               Face::Small, palette::faint, Align::Right, std::max(1.0f, right - used - 12 - x));
}

void Play::draw_hint(const Box& image) {
    if (!hints_ || view_->phase != Phase::Running || countdown_ || shows_solution_ || is_replay_) return;
    // The next hint comes when what the last one asked for was done.
    const exercise::Score& score = view_->score;
    const bool done[] = {score.beam_on_time > 1, score.advanced > 5, score.rotation > 0.5, score.contrast > 1,
                         view_->readout.mode == "ROADMAP"};
    while (hint_ < static_cast<int>(std::size(hints)) && done[hint_]) ++hint_;
    if (hint_ >= static_cast<int>(std::size(hints))) return;
    const std::string words =
        fmt::format(fmt::runtime(hints[hint_].words), options_.keys.first(hints[hint_].action));
    const float width = std::min(image.right - u(20), u(560));
    ImGui::SetNextWindowPos(ImVec2(std::round((image.left + image.right - width) / 2), u(56)));
    ImGui::SetNextWindowSize(ImVec2(width, 0));
    ImGui::SetNextWindowBgAlpha(0.85f);
    ImGui::Begin("hint", nullptr,
                 bare | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_AlwaysAutoResize);
    wrapped(palette::beam, words);
    if (ImGui::SmallButton("No more hints")) {
        hints_ = false;
        save_settings();
    }
    ImGui::End();
}

void Play::draw_countdown() {
    if (!countdown_) return;
    const double left = std::chrono::duration<double>(*countdown_ - room::Clock::now()).count();
    render::Canvas sheet = canvas();
    const float unit = window_.unit();
    const render::Point middle{window_.width() / 2 / unit, window_.height() / 2 / unit};
    sheet.disc(middle, 46, palette::with_alpha(palette::black, 200));
    sheet.arc(middle, 42, -render::half_turn / 2,
              -render::half_turn / 2 +
                  2 * render::half_turn * static_cast<float>(std::clamp(left - std::floor(left), 0.0, 1.0)),
              palette::beam, 4);
    sheet.text({middle.x, middle.y - 11}, fmt::format("{:.0f}", std::max(1.0, std::ceil(left))), Face::Title,
               palette::bright, Align::Centre);
}

void Play::draw_end() {
    begin_page("end", static_cast<float>(window_.width()), static_cast<float>(window_.height()), u(680));
    const exercise::Score& score = view_->score;
    ImGui::PushFont(window_.faces().fonts[static_cast<std::size_t>(Face::Title)]);
    if (shows_solution_ || is_replay_)
        text(palette::bright,
             shows_solution_ ? "That was the solution. Your turn." : "The recording ends here");
    else if (free_practice_)
        text(palette::bright, "Free practice has ended");
    else
        text(score.completed ? palette::good : palette::caution,
             score.completed     ? fmt::format("Target reached: {:.0f} points", grade_ ? grade_->points : 0)
             : view_->time_is_up ? "The time is over: target not reached"
                                 : "Ended: target not reached");
    ImGui::PopFont();
    text(palette::label, session_->options().scenario.title);
    ImGui::Separator();
    if (is_replay_) {
        if (view_->differences.empty()) text(palette::good, "Every recorded state was reached to the bit.");
        for (std::size_t k = 0; k < std::min<std::size_t>(8, view_->differences.size()); ++k)
            wrapped(palette::alarm, view_->differences[k]);
    }
    if (grade_ && ImGui::BeginTable("score", 4, ImGuiTableFlags_RowBg)) {
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, u(260));
        for (const char* name : {"yours", "par", "costs"})
            ImGui::TableSetupColumn(name, ImGuiTableColumnFlags_WidthFixed, u(96));
        ImGui::TableHeadersRow();
        for (const room::GradeLine& line : grade_->lines) {
            const int digits = line.unit == "N" ? 2 : line.unit == "s" ? 1 : 0;
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            text(palette::value, line.name);
            ImGui::TableNextColumn();
            text(line.cost > 0 ? palette::caution : palette::value,
                 line.yours ? fmt::format("{:.{}f} {}", *line.yours, digits, line.unit) : "-");
            ImGui::TableNextColumn();
            text(palette::label, line.par ? fmt::format("{:.{}f} {}", *line.par, digits, line.unit) : "-");
            ImGui::TableNextColumn();
            text(line.cost > 0 ? palette::alarm : palette::faint,
                 line.cost > 0 ? fmt::format("-{:.0f}", line.cost) : "0");
        }
        ImGui::EndTable();
        wrapped(palette::faint, room::grade_formula);
        if (view_->handling.blind_motions > 0)
            wrapped(palette::caution,
                    fmt::format("The wire was moved without beam {} times.", view_->handling.blind_motions));
        if (view_->handling.against_stops > 0)
            wrapped(palette::caution, fmt::format("The wire was pushed or pulled against a stop {} times.",
                                                  view_->handling.against_stops));
    } else if (view_->tuned) {
        text(palette::label, "The instructor changed the model: this attempt has no score.");
    } else if (!free_practice_ && !session_->options().script) {
        text(palette::label, "Par is being worked out ...");
    } else if (free_practice_) {
        text(palette::value, fmt::format("{:.0f} s, {} times taken back", view_->readout.time.value_or(0),
                                         view_->handling.taken_back));
    }
    if (!results_problem_.empty()) wrapped(palette::alarm, results_problem_);
    for (const render::Message& message : view_->readout.messages)
        if (message.notice == render::Notice::Alarm) wrapped(palette::alarm, message.text);
    ImGui::SetCursorPosY(
        std::max(ImGui::GetCursorPosY(), ImGui::GetWindowHeight() - ImGui::GetFrameHeight() - u(10)));
    const std::size_t chosen = *chosen_;
    const bool has_solution = options_.exercises[chosen].solution.has_value();
    if (ImGui::Button("Again")) {
        shows_solution_ = is_replay_ = false;
        open(chosen, free_practice_);
        ImGui::End();
        return;
    }
    ImGui::SameLine();
    if (ImGui::Button("Look at the runs")) review_open_ = true;
    if (has_solution) {
        ImGui::SameLine();
        if (ImGui::Button("Show me")) {
            play_solution();
            ImGui::End();
            return;
        }
    }
    ImGui::SameLine();
    if (ImGui::Button("Other exercises")) leave();
    ImGui::End();
}

void Play::draw_help() {
    begin_page("help", static_cast<float>(window_.width()), static_cast<float>(window_.height()), u(860));
    ImGui::PushFont(window_.faces().fonts[static_cast<std::size_t>(Face::Title)]);
    text(palette::bright, "Keys");
    ImGui::PopFont();
    const float rows = (room::actions + static_cast<float>(options_.keys.injections.size())) / 2 + 4;
    ImGui::BeginChild("list", ImVec2(0, std::min(rows * ImGui::GetTextLineHeightWithSpacing(),
                                                 0.96f * static_cast<float>(window_.height()) - u(110))));
    if (ImGui::BeginTable("keys", 4)) {
        for (const float width : {150.0f, 220.0f, 150.0f, 220.0f})
            ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthStretch, width);
        for (int k = 0; k < room::actions; ++k) {
            const auto action = static_cast<Action>(k);
            ImGui::TableNextColumn();
            text(palette::beam, options_.keys.text(action));
            ImGui::TableNextColumn();
            text(palette::value,
                 std::string(room::info(action).help) + (action < room::first_pressed ? " (hold)" : ""));
        }
        for (const room::InjectionPreset& preset : options_.keys.injections) {
            ImGui::TableNextColumn();
            text(palette::beam, std::string(room::key_names()[preset.key]));
            ImGui::TableNextColumn();
            text(palette::value,
                 fmt::format("inject {} {}", preset.name,
                             preset.through_device ? "at the tip" : "into the " + preset.branch));
        }
        ImGui::EndTable();
    }
    wrapped(palette::label,
            "Mouse: the wheel pushes, dragging on the image pushes (up) and turns (right), with the right "
            "button it moves the table; dragging the "
            "C-arm's pictograms turns it. Gamepad: left stick pushes, right stick turns.");
    ImGui::EndChild();
    if (ImGui::Button("Close")) help_ = false;
    ImGui::End();
}

void Play::draw_menu() {
    begin_page("menu", static_cast<float>(window_.width()), static_cast<float>(window_.height()), u(300));
    const ImVec2 wide(-1, 0);
    const auto go_on = [&] {
        menu_ = false;
        if (session_) session_->give(room::Control::Resume);
    };
    if (ImGui::Button("Go on", wide)) go_on();
    if (ImGui::Button("Keys", wide)) help_ = true;
    if (ImGui::Checkbox("Hints", &hints_)) {
        hint_ = 0;
        save_settings();
    }
    if (session_ && screen_ == Screen::Room) {
        if (ImGui::Button("Instructor's view", wide)) {
            go_on();
            obey(Action::Instructor);
        }
        if (ImGui::Button("Look at the runs", wide)) {
            go_on();
            review_open_ = true;
        }
        if (ImGui::Button("End the exercise", wide)) {
            menu_ = false;
            session_->give(room::Control::Finish);
        }
        if (ImGui::Button("Other exercises", wide)) leave();
    }
    if (ImGui::Button("Quit", wide)) quits_ = true;
    ImGui::End();
}

}  // namespace app

/// The room in the window: live image, reference, readouts, the strip below, hints and countdown.

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <imgui.h>
#include <numbers>

#include "app/play/play.h"
#include "app/play/theme.h"
#include "render/panel/image_marks.h"
#include "render/panel/readout_column.h"

namespace app {
namespace {

namespace palette = render::palette;
using render::Align;
using render::Box;
using render::Face;
using render::Ink;
using room::Action;
using room::Phase;
using Thing = script::TeacherAct::Thing;

struct Hint {
    Action action;
    const char*
        words;  // with the key in place of {0}, and in place of {1} that of the first injection by the pump
};
constexpr Hint hints[] = {
    {Action::Fluoroscopy, "Hold {0} for fluoroscopy: the image is live while the pedal is down"},
    {Action::Advance, "{0} pushes the wire, the mouse wheel as well; Shift is slower, Ctrl faster"},
    {Action::RotateRight, "{0} turns the wire: look for the side that its tip points to"},
    {Action::LeftAdvance, "{0} pushes what the left hand holds, at the same time: the strip below says what"},
    {Action::Acquisition, "Hold {0} for a DSA run, and inject with {1} once its mask is taken"},
    {Action::Roadmap, "{0} lays the vessels of the last DSA run under the live image"}};

constexpr const char* cine_hint = "Hold {0} for a cine run, and inject with {1}";

}  // namespace

void Play::draw_room() {
    const float width = static_cast<float>(window_.width()), height = static_cast<float>(window_.height());
    const float strip = std::round(u(30)), column = std::round(u(render::readout_column_width));
    const float tall = height - strip;
    // Live and reference are as large as each other where that leaves the live image most of its size, as on
    // a console; else the reference stands between image and readouts, or in a corner of the image. What is
    // left below it, or below both, shows the runs.
    const float half = std::floor((width - column) / 2), spare = width - column - tall;
    const bool equal = half >= 0.75f * tall;
    const float beside = equal ? half : spare >= u(150) ? std::min(spare, tall) : 0;
    const float live = equal ? half : width - column - beside;
    const float bottom = equal ? std::min(tall, half + u(22)) : tall;
    const Box image{0, 0, std::max(u(100), live), bottom};
    draw_image(image);
    if (beside > 0) {
        const float end = std::min(tall, beside + u(18));
        draw_reference({width - column - beside, 0, width - column, end});
        draw_runs(equal ? Box{0, end, width - column, tall}
                        : Box{width - column - beside, end, width - column, tall});
    } else if (view_->reference && shows(Thing::Reference)) {
        const float side = 0.28f * std::min(image.right, tall);
        draw_reference({image.right - side - u(8), tall - side - u(84), image.right - u(8), tall - u(64)});
    }
    draw_column({width - column, 0, width, tall});
    draw_strip({0, tall, width, height});
    if (view_->phase == Phase::Failed || view_->phase == Phase::Loading) draw_loading();
    if (!view_) return;  // the trainee left the room
    if (view_->guide)
        draw_guide(image);
    else
        draw_hint(image);
    draw_caption(image);
    draw_countdown();
}

/// What the author says of what the solution does now.
void Play::draw_caption(const Box& image) {
    if (!session_->options().script || view_->frames == 0 || !shows(Thing::Captions)) return;
    const std::string words(session_->options().script->caption_at(view_->frames - 1));
    if (words.empty()) return;
    const float width = std::min(image.right - image.left - u(20), u(620));
    ImGui::SetNextWindowPos(ImVec2(std::round((image.left + image.right) / 2), image.bottom - u(14)),
                            ImGuiCond_Always, ImVec2(0.5f, 1));
    ImGui::SetNextWindowSizeConstraints(ImVec2(width, 0), ImVec2(width, image.bottom));
    ImGui::SetNextWindowBgAlpha(0.8f);
    ImGui::Begin("caption", nullptr,
                 bare | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_AlwaysAutoResize |
                     ImGuiWindowFlags_NoInputs);
    wrapped(palette::bright, words);
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
        list.AddImage(texture_id(image_.id()), ImVec2(left, top), ImVec2(left + side, top + side));
    }
    render::Canvas marks = canvas();
    const float unit = window_.unit();
    render::draw_image_marks(marks, {left / unit, top / unit, (left + side) / unit, (top + side) / unit},
                             view_->readout);
    draw_shown_by_teacher(area, left, top, side);

    if (view_->phase == Phase::Paused && screen_ == Screen::Room) {
        list.AddRectFilled(ImVec2(left, top), ImVec2(left + side, top + side), IM_COL32(14, 18, 21, 150));
        marks.text({(left + side / 2) / unit, (top + side / 2) / unit - 12},
                   view_->teacher_paused ? "THE TEACHER HAS PAUSED" : "PAUSED", Face::Title, palette::caution,
                   Align::Centre);
    }

    // The mouse on the image acts as a hand on the wire.
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
        // The right button drags the image: the table moves the opposite way.
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
    if (!shows(Thing::Reference)) {
        sheet.text({(left + side / 2) / unit, (top + side / 2) / unit - 8}, "hidden by the teacher",
                   Face::Plain, palette::faint, Align::Centre, side / unit);
    } else if (view_->reference) {
        reference_.show(*view_->reference, reinterpret_cast<std::intptr_t>(view_->reference.get()));
        list.AddImage(texture_id(reference_.id()), ImVec2(left, top), ImVec2(left + side, top + side));
    } else {
        sheet.text({(left + side / 2) / unit, (top + side / 2) / unit - 8},
                   options_.keys.first(Action::Reference) + " stores the image here", Face::Plain,
                   palette::faint, Align::Centre, side / unit);
    }
    list.AddRect(ImVec2(left, top), ImVec2(left + side, top + side), colour(palette::rule));
}

/// The runs taken so far, the last first; a click opens one.
void Play::draw_runs(const Box& area) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.AddRectFilled(ImVec2(area.left, area.top), ImVec2(area.right, area.bottom), colour(palette::ground));
    const float unit = window_.unit(), label = u(20), gap = u(6);
    const float side = std::min(u(118), area.bottom - area.top - 2 * label);
    if (side < u(48)) return;
    render::Canvas sheet = canvas();
    sheet.text({(area.left + gap) / unit, (area.top + u(4)) / unit}, "RUNS", Face::Small, palette::label);
    const int columns = std::max(1, static_cast<int>((area.right - area.left - gap) / (side + gap)));
    const int rows = std::max(1, static_cast<int>((area.bottom - area.top - label) / (side + label)));
    const auto& runs = view_->runs;
    for (std::size_t k = 0; k < std::min<std::size_t>(runs.size(), columns * rows); ++k) {
        const room::Sequence& run = *runs[runs.size() - 1 - k];
        if (run.images.empty() || !run.images.back().shown) continue;
        const float left = area.left + gap + static_cast<float>(k % columns) * (side + gap),
                    top = area.top + label + static_cast<float>(k / columns) * (side + label);
        std::unique_ptr<Texture>& picture = run_pictures_[run.number];
        if (!picture) picture = std::make_unique<Texture>(window_.gl());
        picture->show(*run.images.back().shown, static_cast<long>(run.images.size()));
        list.AddImage(texture_id(picture->id()), ImVec2(left, top), ImVec2(left + side, top + side));
        list.AddRect(ImVec2(left, top), ImVec2(left + side, top + side), colour(palette::rule));
        sheet.text({left / unit, (top + side + u(3)) / unit},
                   fmt::format("{} {}  {}", run.number, script::title_of(run.mode), run.images.size()),
                   Face::Small, palette::faint);
        ImGui::SetNextWindowPos(ImVec2(left, top));
        ImGui::SetNextWindowSize(ImVec2(side, side));
        ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
        ImGui::Begin(fmt::format("run {}", k).c_str(), nullptr, bare | ImGuiWindowFlags_NoBackground);
        ImGui::SetCursorPos(ImVec2(0, 0));
        if (ImGui::InvisibleButton("open", ImVec2(side, side))) {
            review_open_ = true;
            review_.go_to(runs, run.images.front().time.index);
        }
        ImGui::End();
        ImGui::PopStyleVar();
    }
}

void Play::draw_column(const Box& area) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.AddRectFilled(ImVec2(area.left, area.top), ImVec2(area.right, area.bottom), colour(palette::ground));
    render::Canvas sheet = canvas({area.left, area.top});
    const float unit = window_.unit();
    const float width = (area.right - area.left) / unit, height = (area.bottom - area.top) / unit;
    render::draw_readouts(sheet, {0, 4, width, height}, shown_readout());

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
    item("ERRORS", std::to_string(score.handling_errors.size()),
         score.handling_errors.empty() ? palette::value : palette::caution);
    if (r.devices.size() > 1 && !session_->options().script) {
        const auto held = [](const std::string& names) { return names.empty() ? "-" : names; };
        item("LEFT", held(r.left_hand));
        item("RIGHT", held(r.held));
        item("HELPER", held(r.helper));
    }
    if (free_practice_) item("FREE PRACTICE", fmt::format("{} taken back", view_->taken_back), palette::calm);
    if (shows_solution_) item("SOLUTION", "your turn comes next", palette::calm);
    if (is_replay_)
        item("REPLAY", view_->differences.empty() ? "as recorded" : "differs",
             view_->differences.empty() ? palette::calm : palette::alarm);
    if (view_->phase == Phase::Paused)
        item("PAUSED",
             view_->teacher_paused ? "the teacher lets you go on"
             : asking_             ? "answer first"
                                   : options_.keys.first(Action::Pause) + " goes on",
             palette::caution);
    if (!teacher_problem_.empty()) item("TEACHER", teacher_problem_, palette::alarm);
    if (view_->slow) item("SLOW", "frames are late", palette::alarm);
    const float right = (area.right - area.left) / window_.unit() - 14;
    const std::string record = view_->recording                                   ? "REC"
                               : session_->options().script || view_->frames == 0 ? ""
                                                                                  : "NOT RECORDED";
    const float used = sheet.text({right, 9}, record, Face::Small,
                                  view_->recording ? palette::good : palette::alarm, Align::Right);
    sheet.text({right - used - 12, 9},
               fmt::format("{} keys   {} menu", options_.keys.first(Action::Help),
                           options_.keys.first(Action::Menu)),
               Face::Small, palette::faint, Align::Right, std::max(1.0f, right - used - 12 - x));
}

void Play::draw_hint(const Box& image) {
    if (!hints_ || !shows(Thing::Hints) || view_->phase != Phase::Running || countdown_ || shows_solution_ ||
        is_replay_)
        return;
    // The next hint appears when the action requested by the last one was done.
    const exercise::Score& score = view_->score;
    const bool cine = session_->options().scenario.imaging.acquisition == script::ImagingMode::Cine;
    const bool done[] = {score.beam_on_time > 1, score.advanced > 5,
                         score.rotation > 0.5,   used_left_ || view_->readout.devices.size() < 2,
                         score.contrast > 1,     cine || view_->readout.mode == "ROADMAP"};
    while (hint_ < static_cast<int>(std::size(hints)) && done[hint_]) ++hint_;
    if (hint_ >= static_cast<int>(std::size(hints))) return;
    std::string pump = "no key";
    for (const room::InjectionPreset& preset : options_.keys.injections)
        if (preset.by == room::InjectionPreset::By::Pump && pump == "no key")
            pump = options_.keys.label(preset.key);
    const std::string words = fmt::format(
        fmt::runtime(cine && hints[hint_].action == Action::Acquisition ? cine_hint : hints[hint_].words),
        options_.keys.first(hints[hint_].action), pump);
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

}  // namespace app

#include "app/play/review.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <imgui.h>
#include <tuple>

#include "app/play/theme.h"

namespace app {

void Review::reset() {
    run_.reset();
    shown_run_.reset();
    shown_.reset();
    number_ = 0;
    look_ = {};
    zoom_ = 1;
    left_ = top_ = 0;
    ruler_.reset();
    scale_ = {};
    plays_ = true;
}

void Review::show() {
    look_.image = std::min(look_.image, run_->images.size() - 1);
    look_.mask = std::min(look_.mask, run_->images.size() - 1);
    const auto same = [](const room::Look& a, const room::Look& b) {
        return a.image == b.image && a.mask == b.mask && a.shift_x == b.shift_x && a.shift_y == b.shift_y &&
               a.window == b.window && a.level == b.level;
    };
    if (shown_ && shown_run_ == run_ && same(*shown_, look_)) return;
    image_ = room::look_at(*run_, look_);
    texture_.show(image_, ++serial_);
    shown_ = look_;
    shown_run_ = run_;
}

void Review::go_to(const std::vector<std::shared_ptr<const room::Sequence>>& runs, int frame) {
    const auto [at, image] = room::moment_of(runs, frame);
    if (!at) return;
    run_ = at;
    number_ = at->number;
    look_.image = image;
    look_.mask = 0;
    time_ = static_cast<double>(image) / at->pulse_rate;
    plays_ = false;
}

bool Review::draw(const std::vector<std::shared_ptr<const room::Sequence>>& runs, const render::Box& area,
                  const Window& window, double seconds, double wire) {
    const float unit = window.unit();
    bool open = true;
    ImGui::SetNextWindowPos(ImVec2(area.left, area.top));
    ImGui::SetNextWindowSize(ImVec2(area.right - area.left, area.bottom - area.top));
    ImGui::Begin("Runs", &open,
                 ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                     ImGuiWindowFlags_NoSavedSettings);
    if (runs.empty()) {
        ImGui::TextUnformatted("No run was taken yet: hold a pedal first.");
        ImGui::End();
        return open;
    }
    const auto found =
        std::find_if(runs.begin(), runs.end(), [&](const auto& r) { return r->number == number_; });
    const auto chosen = found == runs.end() ? runs.back() : *found;
    if (!run_ || run_->number != chosen->number) {
        look_.image = look_.mask = 0;
        time_ = 0;
    }
    run_ = chosen;
    number_ = run_->number;
    const std::size_t count = run_->images.size();
    if (plays_ && count > 1) {
        time_ += seconds;
        look_.image = static_cast<std::size_t>(time_ * run_->pulse_rate) % count;
    }
    show();

    ImGui::BeginChild("controls", ImVec2(unit * 250, 0));
    for (const auto& run : runs) {
        const std::string name =
            fmt::format("{}  {}  {} images", run->number, script::title_of(run->mode), run->images.size());
        if (ImGui::RadioButton(name.c_str(), run->number == number_)) number_ = run->number;
    }
    ImGui::Separator();
    if (ImGui::Button(plays_ ? "Stop" : "Play")) plays_ = !plays_;
    ImGui::SameLine();
    const auto step = [&](std::size_t by) {
        plays_ = false;
        look_.image = (look_.image + by) % count;
        time_ = static_cast<double>(look_.image) / run_->pulse_rate;
    };
    if (ImGui::Button("<")) step(count - 1);
    ImGui::SameLine();
    if (ImGui::Button(">")) step(1);
    int image = static_cast<int>(look_.image) + 1;
    ImGui::SetNextItemWidth(-1);
    if (ImGui::SliderInt("##image", &image, 1, static_cast<int>(count), "image %d")) {
        plays_ = false;
        look_.image = static_cast<std::size_t>(std::clamp(image, 1, static_cast<int>(count)) - 1);
    }
    if (run_->mode == script::ImagingMode::Dsa) {
        if (ImGui::Button("This image is the mask")) look_.mask = look_.image;
        ImGui::SameLine();
        ImGui::Text("mask %d", static_cast<int>(look_.mask) + 1);
        float shift[2] = {static_cast<float>(look_.shift_x), static_cast<float>(look_.shift_y)};
        ImGui::SetNextItemWidth(-unit * 80);
        if (ImGui::DragFloat2("pixel shift", shift, 0.05f, -20, 20, "%.2f")) {
            look_.shift_x = shift[0];
            look_.shift_y = shift[1];
        }
    }
    float values[2] = {static_cast<float>(look_.window), static_cast<float>(look_.level)};
    ImGui::SetNextItemWidth(-unit * 80);
    if (ImGui::SliderFloat("window", &values[0], 16, 512, "%.0f")) look_.window = values[0];
    ImGui::SetNextItemWidth(-unit * 80);
    if (ImGui::SliderFloat("level", &values[1], 0, 255, "%.0f")) look_.level = values[1];
    ImGui::SetNextItemWidth(-unit * 80);
    ImGui::SliderFloat("zoom", &zoom_, 1, 8, "%.1f");
    ImGui::Separator();
    ImGui::Checkbox("Ruler: drag on the image", &rules_);
    if (ruler_) {
        ImGui::TextUnformatted(scale_.length(*run_, *ruler_).c_str());
        ImGui::TextDisabled("%s", scale_.text(*run_).c_str());
        if (ImGui::Button("It crosses the wire: calibrate")) scale_.calibrate(image_, *ruler_, wire);
        if (!scale_.found.empty()) ImGui::TextDisabled("%s", scale_.found.c_str());
        if (scale_.calibrated && ImGui::Button("Back to the isocentre's scale")) scale_.calibrated.reset();
    }
    ImGui::EndChild();
    ImGui::SameLine();
    const ImVec2 corner = ImGui::GetCursorScreenPos(), room = ImGui::GetContentRegionAvail();
    draw_picture({corner.x, corner.y, corner.x + room.x, corner.y + room.y}, window);
    ImGui::End();
    if (!open) ruler_.reset();
    return open;
}

void Review::draw_picture(const render::Box& area, const Window& window) {
    const float side = std::floor(std::max(16.0f, std::min(area.right - area.left, area.bottom - area.top)));
    const float part = 1 / zoom_;
    left_ = std::clamp(left_, 0.0f, 1 - part);
    top_ = std::clamp(top_, 0.0f, 1 - part);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImVec2 low(area.left, area.top), high(area.left + side, area.top + side);
    list.AddImage(texture_id(texture_.id()), low, high, ImVec2(left_, top_),
                  ImVec2(left_ + part, top_ + part));
    ImGui::InvisibleButton("picture", ImVec2(side, side));
    const ImGuiIO& io = ImGui::GetIO();
    const double pixels = image_.width * part / side;  // pixels of the image per pixel of the window
    const auto place = [&](ImVec2 p) {
        return std::pair{left_ * image_.width + (p.x - low.x) * pixels,
                         top_ * image_.height + (p.y - low.y) * pixels};
    };
    if (ImGui::IsItemActivated() && rules_) {
        const auto [x, y] = place(io.MousePos);
        ruler_ = room::Ruler{x, y, x, y};
        draws_ = true;
    }
    if (ImGui::IsItemActive()) {
        if (rules_ && draws_ && ruler_) {
            std::tie(ruler_->x1, ruler_->y1) = place(io.MousePos);
        } else if (!rules_) {
            left_ -= io.MouseDelta.x * part / side;
            top_ -= io.MouseDelta.y * part / side;
        }
    } else {
        draws_ = false;
    }
    if (ImGui::IsItemHovered() && io.MouseWheel != 0)
        zoom_ = std::clamp(zoom_ * (io.MouseWheel > 0 ? 1.25f : 0.8f), 1.0f, 8.0f);
    if (ruler_) {
        const auto on_screen = [&](double x, double y) {
            return ImVec2(low.x + static_cast<float>((x - left_ * image_.width) / pixels),
                          low.y + static_cast<float>((y - top_ * image_.height) / pixels));
        };
        list.PushClipRect(low, high);
        list.AddLine(on_screen(ruler_->x0, ruler_->y0), on_screen(ruler_->x1, ruler_->y1),
                     colour(render::palette::beam), 2 * window.unit());
        list.PopClipRect();
    }
    list.AddText(ImVec2(low.x + 8, low.y + 6), colour(render::palette::bright),
                 fmt::format("{} {}: image {} of {}", script::title_of(run_->mode), run_->number,
                             look_.image + 1, run_->images.size())
                     .c_str());
}

}  // namespace app

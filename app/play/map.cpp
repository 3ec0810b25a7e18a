#include "app/play/map.h"

#include <algorithm>
#include <cmath>
#include <imgui.h>
#include <vector>

#include "app/play/theme.h"

namespace app {
namespace {

namespace palette = render::palette;

/// A stretch of a branch's centreline, from one sample to another, in either direction.
struct Stretch {
    int branch, from, to;
};

/// From the place up to the root of its tree.
std::vector<Stretch> path_up(const anatomy::Anatomy& anatomy, anatomy::VesselPlace place) {
    std::vector<Stretch> path;
    while (place.branch >= 0 && path.size() <= anatomy.branches.size()) {
        path.push_back({place.branch, place.sample, 0});
        const anatomy::CentrelineBranch& branch = anatomy.branches[place.branch];
        place = {branch.parent, branch.parent_sample, 0};
    }
    return path;
}

/// From one place to the other, over the branch that both are below.
geometry::Polyline path_between(const anatomy::Anatomy& anatomy, const anatomy::VesselPlace& start,
                                const anatomy::VesselPlace& target) {
    const std::vector<Stretch> up = path_up(anatomy, start), down = path_up(anatomy, target);
    std::vector<Stretch> path;
    for (const Stretch& of_start : up) {
        const auto meets = std::find_if(down.begin(), down.end(), [&](const Stretch& stretch) {
            return stretch.branch == of_start.branch;
        });
        if (meets == down.end()) {
            path.push_back(of_start);
            continue;
        }
        path.push_back({of_start.branch, of_start.from, meets->from});
        for (auto stretch = meets; stretch != down.begin();) {
            --stretch;
            path.push_back({stretch->branch, 0, stretch->from});
        }
        geometry::Polyline points;
        for (const Stretch& stretch : path) {
            const auto& line = anatomy.branches[stretch.branch].points;
            const int step = stretch.to >= stretch.from ? 1 : -1;
            for (int i = stretch.from; i != stretch.to + step; i += step) points.push_back(line[i]);
        }
        return points;
    }
    return {};
}

}  // namespace

geometry::Vec3 target_of(const scenario::Target& target, const anatomy::Anatomy& anatomy) {
    for (const anatomy::VesselTarget& known : anatomy.targets)
        if (known.name == target.name) return known.centre;
    return target.centre.value_or(geometry::Vec3::Zero());
}

void draw_map(ImDrawList& list, const render::Box& area, float unit, const anatomy::Anatomy& anatomy,
              const render::CArm& view, const MapMarks& marks) {
    const render::ArmAxes axes = render::axes(view);
    const auto flat = [&](const geometry::Vec3& p) { return ImVec2(axes.right.dot(p), -axes.up.dot(p)); };
    const geometry::Polyline path = path_between(anatomy, anatomy::nearest_place(anatomy, marks.start),
                                                 anatomy::nearest_place(anatomy, marks.target));
    // The way with some of the vessels around it.
    ImVec2 low = flat(marks.target), high = low;
    const auto cover = [&](const geometry::Vec3& p) {
        const ImVec2 q = flat(p);
        low = {std::min(low.x, q.x), std::min(low.y, q.y)};
        high = {std::max(high.x, q.x), std::max(high.y, q.y)};
    };
    cover(marks.start);
    for (const geometry::Vec3& p : path) cover(p);
    const float margin = 0.12f * std::max(high.x - low.x, high.y - low.y) + 15;
    const float width = area.right - area.left, height = area.bottom - area.top;
    const float scale =
        std::min(width / (high.x - low.x + 2 * margin), height / (high.y - low.y + 2 * margin));
    const ImVec2 middle((low.x + high.x) / 2, (low.y + high.y) / 2);
    const auto at = [&](const geometry::Vec3& p) {
        const ImVec2 q = flat(p);
        return ImVec2((area.left + area.right) / 2 + (q.x - middle.x) * scale,
                      (area.top + area.bottom) / 2 + (q.y - middle.y) * scale);
    };
    const ImVec2 corner(area.left, area.top), other(area.right, area.bottom);
    list.AddRectFilled(corner, other, colour(palette::well));
    list.PushClipRect(corner, other, true);
    for (const float rim : {1.0f, 0.0f}) {
        const ImU32 ink = colour(rim > 0 ? render::Ink{120, 128, 134} : render::Ink{58, 68, 76});
        for (const anatomy::CentrelineBranch& branch : anatomy.branches) {
            std::vector<ImVec2> points;
            float thick = 0;
            // Stretches of about one width, each as wide as it is.
            const auto flush = [&] {
                if (points.size() > 1)
                    list.AddPolyline(points.data(), static_cast<int>(points.size()), ink, 0,
                                     std::max(1.0f, thick) + 2 * rim);
                if (!points.empty()) points.erase(points.begin(), points.end() - 1);
            };
            for (std::size_t i = 0; i < branch.points.size(); ++i) {
                points.push_back(at(branch.points[i]));
                thick = 2 * static_cast<float>(branch.radii[i]) * scale;
                list.AddCircleFilled(points.back(), thick / 2 + rim, ink, 12);
                if (points.size() > 4) flush();
            }
            flush();
        }
    }
    // The way, dashed.
    double gone = 0;
    for (std::size_t i = 1; i < path.size(); ++i) {
        const ImVec2 a = at(path[i - 1]), b = at(path[i]);
        const double step = std::hypot(b.x - a.x, b.y - a.y);
        if (std::fmod(gone, 12.0 * unit) < 7.0 * unit) list.AddLine(a, b, colour(palette::beam), 2.2f * unit);
        gone += step;
    }
    const ImVec2 start = at(marks.start), target = at(marks.target);
    const float ring = std::max(7 * unit, static_cast<float>(marks.radius) * scale);
    list.AddCircle(target, ring, colour(palette::good), 32, 2.5f * unit);
    list.AddLine(ImVec2(target.x - 4 * unit, target.y), ImVec2(target.x + 4 * unit, target.y),
                 colour(palette::good), 1.5f * unit);
    list.AddLine(ImVec2(target.x, target.y - 4 * unit), ImVec2(target.x, target.y + 4 * unit),
                 colour(palette::good), 1.5f * unit);
    list.AddCircleFilled(start, 4 * unit, colour(palette::beam));
    const auto label = [&](ImVec2 place, const char* words, render::Ink ink) {
        const ImVec2 size = ImGui::CalcTextSize(words);
        const float x = std::clamp(place.x + 9 * unit, area.left + 4, area.right - size.x - 4),
                    y = std::clamp(place.y - size.y / 2, area.top + 2, area.bottom - size.y - 2);
        list.AddRectFilled(ImVec2(x - 2, y), ImVec2(x + size.x + 2, y + size.y), IM_COL32(7, 10, 12, 190));
        list.AddText(ImVec2(x, y), colour(ink), words);
    };
    label({target.x + ring - 6 * unit, target.y}, "target", palette::good);
    label(start, "start", palette::beam);
    list.PopClipRect();
}

}  // namespace app

#include "app/play/map.h"

#include <algorithm>
#include <cmath>
#include <imgui.h>
#include <vector>

#include "app/play/theme.h"

namespace app {
namespace palette = render::palette;

void draw_map(ImDrawList& list, const render::Box& area, float unit, const room::WayMap& map) {
    const float width = area.right - area.left, height = area.bottom - area.top;
    const double scale = std::min(width / (map.high.x - map.low.x), height / (map.high.y - map.low.y));
    const double middle_x = (map.low.x + map.high.x) / 2, middle_y = (map.low.y + map.high.y) / 2;
    const auto at = [&](const room::WayMap::Point& p) {
        return ImVec2((area.left + area.right) / 2 + static_cast<float>((p.x - middle_x) * scale),
                      (area.top + area.bottom) / 2 + static_cast<float>((p.y - middle_y) * scale));
    };
    const ImVec2 corner(area.left, area.top), other(area.right, area.bottom);
    list.AddRectFilled(corner, other, colour(palette::well));
    list.PushClipRect(corner, other, true);
    for (const float rim : {1.0f, 0.0f}) {
        const ImU32 ink = colour(rim > 0 ? render::Ink{120, 128, 134} : render::Ink{58, 68, 76});
        for (const room::WayMap::Branch& branch : map.vessels) {
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
                thick = static_cast<float>(2 * branch.radii[i] * scale);
                list.AddCircleFilled(points.back(), thick / 2 + rim, ink, 12);
                if (points.size() > 4) flush();
            }
            flush();
        }
    }
    // The way, dashed.
    double gone = 0;
    for (std::size_t i = 1; i < map.way.size(); ++i) {
        const ImVec2 a = at(map.way[i - 1]), b = at(map.way[i]);
        const double step = std::hypot(b.x - a.x, b.y - a.y);
        if (std::fmod(gone, (map.dash + map.gap) * unit) < map.dash * unit)
            list.AddLine(a, b, colour(palette::beam), 2.2f * unit);
        gone += step;
    }
    const ImVec2 start = at(map.start), target = at(map.target);
    const float ring = std::max(7 * unit, static_cast<float>(map.radius * scale));
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

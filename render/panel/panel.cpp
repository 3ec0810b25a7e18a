#include "render/panel/panel.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "render/panel/canvas.h"
#include "render/panel/image_marks.h"
#include "render/panel/palette.h"
#include "render/panel/readout_column.h"

namespace render {

namespace {

constexpr float design_width = 1280.0f, design_height = 1024.0f;  // [units]
constexpr int live_slot = 0, reference_slot = 1;

PanelSpec require_usable(PanelSpec spec) {
    if (spec.width < 640 || spec.width > 4096 || spec.height < 512 || spec.height > 4096) {
        throw std::invalid_argument("a panel of " + std::to_string(spec.width) + "x" +
                                    std::to_string(spec.height) +
                                    " pixels; from 640x512 to 4096x4096 can be drawn");
    }
    return spec;
}

void require_pixels(const GrayImage& image, const char* name) {
    constexpr int most = 4096;
    if (image.width < 1 || image.height < 1 || image.width > most || image.height > most ||
        image.pixels.size() != static_cast<std::size_t>(image.width) * image.height) {
        throw std::invalid_argument("the " + std::string(name) + " image of " + std::to_string(image.width) +
                                    "x" + std::to_string(image.height) + " with " +
                                    std::to_string(image.pixels.size()) + " pixels cannot be shown");
    }
}

PanelArea fitted(int width, int height, const PanelArea& room) {
    const double scale = std::min(double(room.width) / width, double(room.height) / height);
    const int columns = std::clamp(static_cast<int>(std::lround(width * scale)), 1, room.width),
              rows = std::clamp(static_cast<int>(std::lround(height * scale)), 1, room.height);
    return {room.left + (room.width - columns) / 2, room.top + (room.height - rows) / 2, columns, rows};
}

}  // namespace

struct Panel::State {
    PanelSpec spec;
    float unit;  // [pixels]
    Canvas canvas;

    explicit State(PanelSpec wanted)
        : spec(require_usable(std::move(wanted))),
          unit(std::min(float(spec.width) / design_width, float(spec.height) / design_height)),
          canvas(spec.width, spec.height, unit, spec.fonts) {}

    int pixels(float length) const { return static_cast<int>(std::lround(length * unit)); }
    Box units(const PanelArea& a) const {
        return {float(a.left) / unit, float(a.top) / unit, float(a.left + a.width) / unit,
                float(a.top + a.height) / unit};
    }

    PanelArea live_room() const { return {0, 0, spec.width - pixels(readout_column_width), spec.height}; }

    /// Returns the area below it.
    Box draw_reference(const GrayImage* reference, const Readout& r) {
        constexpr float margin = 12.0f, side = readout_column_width - 2.0f * margin;
        // A balloon's section needs room below.
        const float tall = r.balloon ? 0.5f * side : side;
        const float left = units(live_room()).right + margin, right = left + side;
        const float width = canvas.text({left, 8.0f}, "REFERENCE", Face::Small, palette::label);
        canvas.text({right, 8.0f}, r.reference_label, Face::Small, palette::value, Align::Right,
                    side - width - 12.0f);
        const PanelArea room{pixels(left), pixels(24.0f), pixels(side), pixels(tall)};
        const Box well = units(room);
        canvas.box(well, palette::well);
        if (reference != nullptr) {
            const PanelArea area = fitted(reference->width, reference->height, room);
            canvas.picture(reference_slot, *reference, area.left, area.top, area.width, area.height);
        } else {
            canvas.text({0.5f * (left + right), 0.5f * (well.top + well.bottom) - 8.0f}, "no image stored",
                        Face::Plain, palette::faint, Align::Centre);
        }
        canvas.frame(well, palette::rule);
        return {left - margin, well.bottom + 8.0f, right + margin, float(spec.height) / unit};
    }
};

Panel::Panel(PanelSpec spec) : state_(std::make_unique<State>(std::move(spec))) {}
Panel::~Panel() = default;
Panel& Panel::operator=(Panel&&) noexcept = default;

bool Panel::has_font() const {
    return state_->canvas.has_font();
}

PanelArea Panel::live_area(int image_width, int image_height) const {
    return fitted(image_width, image_height, state_->live_room());
}

ColourImage Panel::draw(const GrayImage& live, const GrayImage* reference, const Readout& readout) {
    require_pixels(live, "live");
    if (reference != nullptr) require_pixels(*reference, "reference");
    Canvas& canvas = state_->canvas;
    return canvas.draw([&] {
        const PanelArea area = live_area(live.width, live.height), room = state_->live_room();
        canvas.picture(live_slot, live, area.left, area.top, area.width, area.height);
        const Box screen = state_->units(room);
        canvas.clip(screen);
        draw_image_marks(canvas, state_->units(live_area(1, 1)),
                         readout);  // along a square, whatever the image's shape
        canvas.unclip();
        const Box column{screen.right, 0.0f, float(state_->spec.width) / state_->unit, screen.bottom};
        canvas.box(column, palette::ground);
        draw_readouts(canvas, state_->draw_reference(reference, readout), readout);
    });
}

}  // namespace render

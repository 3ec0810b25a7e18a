#include "render/panel/contact_sheet.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "render/panel/canvas.h"
#include "render/panel/palette.h"
#include "render/panel/panel.h"
#include "render/picture/resample.h"

namespace render {
namespace {

constexpr int gap = 4;  // between tiles [pixels]

/// Each label has a dark background, to be readable on any image.
GrayImage labelled(const GrayImage& sheet, std::span<const std::string> labels, int columns, int tile_width,
                   int tile_height) {
    Canvas canvas(sheet.width, sheet.height, 1.0f, PanelSpec().fonts);
    const ColourImage drawn = canvas.draw([&] {
        canvas.picture(0, sheet, 0, 0, sheet.width, sheet.height);
        constexpr float margin = 3.0f;
        for (int n = 0; n < static_cast<int>(labels.size()); ++n) {
            if (labels[n].empty()) continue;
            const auto left = static_cast<float>(gap + n % columns * (tile_width + gap)),
                       top = static_cast<float>(gap + n / columns * (tile_height + gap));
            const float room = static_cast<float>(tile_width) - 2 * margin;
            const float width = std::min(canvas.text_width(labels[n], Face::Plain), room);
            canvas.clip(
                {left, top, left + static_cast<float>(tile_width), top + static_cast<float>(tile_height)});
            canvas.box({left, top, left + width + 2 * margin, top + canvas.text_height(Face::Plain) + margin},
                       palette::black);
            canvas.text({left + margin, top + 1}, labels[n], Face::Plain, palette::bright, Align::Left, room);
            canvas.unclip();
        }
    });
    GrayImage result = sheet;
    for (std::size_t i = 0; i < result.pixels.size(); ++i) result.pixels[i] = drawn.pixels[3 * i];
    return result;
}

}  // namespace

GrayImage contact_sheet(std::span<const GrayImage> images, int columns, int tile_width,
                        std::span<const std::string> labels) {
    if (images.empty() || columns < 1 || tile_width < 1) {
        throw std::invalid_argument("a contact sheet needs images, a column and a tile width");
    }
    int tile_height = 1;
    std::vector<GrayImage> tiles;
    for (const GrayImage& image : images) {
        const double shape = double(image.height) / std::max(1, image.width);
        tiles.push_back(
            resized(image, tile_width, std::max(1, static_cast<int>(std::lround(shape * tile_width)))));
        tile_height = std::max(tile_height, tiles.back().height);
    }
    const int count = static_cast<int>(images.size());
    columns = std::min(columns, count);
    const int rows = (count + columns - 1) / columns;
    GrayImage sheet{columns * (tile_width + gap) + gap, rows * (tile_height + gap) + gap, {}};
    sheet.pixels.assign(static_cast<std::size_t>(sheet.width) * sheet.height, 0);
    for (int n = 0; n < count; ++n) {
        const GrayImage& tile = tiles[n];
        const int left = gap + n % columns * (tile_width + gap),
                  top = gap + n / columns * (tile_height + gap);
        for (int j = 0; j < tile.height; ++j) {
            std::copy_n(&tile.pixels[static_cast<std::size_t>(j) * tile.width], tile.width,
                        &sheet.pixels[static_cast<std::size_t>(top + j) * sheet.width + left]);
        }
    }
    labels = labels.first(std::min(labels.size(), images.size()));
    const bool any =
        std::any_of(labels.begin(), labels.end(), [](const auto& label) { return !label.empty(); });
    return any ? labelled(sheet, labels, columns, tile_width, tile_height) : sheet;
}

}  // namespace render

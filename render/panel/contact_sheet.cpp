#include "render/panel/contact_sheet.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace render {

namespace {

using Glyph = std::array<std::uint8_t, 7>;  // rows from the top, bit 4 leftmost

// Drawn for this program.
constexpr std::string_view letters = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ .:-+/%";
constexpr Glyph glyphs[] = {
    {14, 17, 19, 21, 25, 17, 14}, {4, 12, 4, 4, 4, 4, 14},      {14, 17, 1, 2, 4, 8, 31},
    {31, 2, 4, 2, 1, 17, 14},     {2, 6, 10, 18, 31, 2, 2},     {31, 16, 30, 1, 1, 17, 14},
    {6, 8, 16, 30, 17, 17, 14},   {31, 1, 2, 4, 8, 8, 8},       {14, 17, 17, 14, 17, 17, 14},
    {14, 17, 17, 15, 1, 2, 12},   {14, 17, 17, 31, 17, 17, 17}, {30, 17, 17, 30, 17, 17, 30},
    {14, 17, 16, 16, 16, 17, 14}, {28, 18, 17, 17, 17, 18, 28}, {31, 16, 16, 30, 16, 16, 31},
    {31, 16, 16, 30, 16, 16, 16}, {14, 17, 16, 23, 17, 17, 15}, {17, 17, 17, 31, 17, 17, 17},
    {14, 4, 4, 4, 4, 4, 14},      {7, 2, 2, 2, 2, 18, 12},      {17, 18, 20, 24, 20, 18, 17},
    {16, 16, 16, 16, 16, 16, 31}, {17, 27, 21, 21, 17, 17, 17}, {17, 17, 25, 21, 19, 17, 17},
    {14, 17, 17, 17, 17, 17, 14}, {30, 17, 17, 30, 16, 16, 16}, {14, 17, 17, 17, 21, 18, 13},
    {30, 17, 17, 30, 20, 18, 17}, {15, 16, 16, 14, 1, 1, 30},   {31, 4, 4, 4, 4, 4, 4},
    {17, 17, 17, 17, 17, 17, 14}, {17, 17, 17, 17, 17, 10, 4},  {17, 17, 17, 21, 21, 27, 17},
    {17, 17, 10, 4, 10, 17, 17},  {17, 17, 17, 10, 4, 4, 4},    {31, 1, 2, 4, 8, 16, 31},
    {0, 0, 0, 0, 0, 0, 0},        {0, 0, 0, 0, 0, 12, 12},      {0, 12, 12, 0, 12, 12, 0},
    {0, 0, 0, 31, 0, 0, 0},       {0, 4, 4, 31, 4, 4, 0},       {0, 1, 2, 4, 8, 16, 0},
    {24, 25, 2, 4, 8, 19, 3}};
constexpr Glyph unknown = {31, 17, 17, 17, 17, 17, 31};
static_assert(std::size(glyphs) == letters.size());

const Glyph& glyph_of(char letter) {
    const auto at = letters.find(static_cast<char>(std::toupper(static_cast<unsigned char>(letter))));
    return at == std::string_view::npos ? unknown : glyphs[at];
}

void require_pixels(const GrayImage& image) {
    if (image.width < 1 || image.height < 1 ||
        image.pixels.size() != static_cast<std::size_t>(image.width) * image.height) {
        throw std::invalid_argument("an image without pixels cannot be resampled");
    }
}

/// Shares that old pixels have in new pixel `i` along one side.
struct Span {
    int first = 0;
    std::vector<double> shares;  // sum 1
};
Span span_of(int i, int from, int to) {
    const double start = double(i) * from / to, stop = double(i + 1) * from / to;
    Span span{std::min(static_cast<int>(start), from - 1), {}};
    for (int k = span.first; k < from && k < stop; ++k) {
        span.shares.push_back((std::min(stop, k + 1.0) - std::max(start, double(k))) / (stop - start));
    }
    return span;
}

}  // namespace

GrayImage resample(const GrayImage& image, int width, int height) {
    require_pixels(image);
    if (width < 1 || height < 1) throw std::invalid_argument("an image cannot be resampled to nothing");
    std::vector<Span> columns;
    for (int i = 0; i < width; ++i) columns.push_back(span_of(i, image.width, width));
    GrayImage result{width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(width) * height)};
    for (int j = 0; j < height; ++j) {
        const Span rows = span_of(j, image.height, height);
        for (int i = 0; i < width; ++i) {
            double sum = 0.0;
            for (std::size_t r = 0; r < rows.shares.size(); ++r) {
                const std::uint8_t* row =
                    &image
                         .pixels[(rows.first + r) * image.width + static_cast<std::size_t>(columns[i].first)];
                for (std::size_t c = 0; c < columns[i].shares.size(); ++c) {
                    sum += rows.shares[r] * columns[i].shares[c] * row[c];
                }
            }
            result.pixels[static_cast<std::size_t>(j) * width + i] =
                static_cast<std::uint8_t>(std::lround(sum));
        }
    }
    return result;
}

void draw_text(GrayImage& image, int x, int y, std::string_view text, std::uint8_t grey) {
    for (char letter : text) {
        const Glyph& glyph = glyph_of(letter);
        for (int row = 0; row < letter_height; ++row) {
            for (int column = 0; column < 5; ++column) {
                const int px = x + column, py = y + row;
                if ((glyph[row] >> (4 - column) & 1) == 0) continue;
                if (px < 0 || px >= image.width || py < 0 || py >= image.height) continue;
                image.pixels[static_cast<std::size_t>(py) * image.width + px] = grey;
            }
        }
        x += letter_width;
    }
}

GrayImage contact_sheet(std::span<const GrayImage> images, int columns, int tile_width,
                        std::span<const std::string> labels) {
    if (images.empty() || columns < 1 || tile_width < 1) {
        throw std::invalid_argument("a contact sheet needs images, a column and a tile width");
    }
    constexpr int gap = 4;
    constexpr std::uint8_t paper = 0, ink = 255;
    const auto height_of = [tile_width](const GrayImage& image) {
        return std::max(1, static_cast<int>(std::lround(double(image.height) * tile_width / image.width)));
    };
    int tile_height = 1;
    for (const GrayImage& image : images) {
        require_pixels(image);
        tile_height = std::max(tile_height, height_of(image));
    }
    const int count = static_cast<int>(images.size());
    columns = std::min(columns, count);
    const int rows = (count + columns - 1) / columns;
    GrayImage sheet{columns * (tile_width + gap) + gap, rows * (tile_height + gap) + gap, {}};
    sheet.pixels.assign(static_cast<std::size_t>(sheet.width) * sheet.height, paper);
    for (int n = 0; n < count; ++n) {
        const GrayImage tile = resample(images[n], tile_width, height_of(images[n]));
        const int left = gap + n % columns * (tile_width + gap),
                  top = gap + n / columns * (tile_height + gap);
        for (int j = 0; j < tile.height; ++j) {
            std::copy_n(&tile.pixels[static_cast<std::size_t>(j) * tile.width], tile.width,
                        &sheet.pixels[static_cast<std::size_t>(top + j) * sheet.width + left]);
        }
        if (n >= static_cast<int>(labels.size()) || labels[n].empty()) continue;
        // On a dark ground, cut to the tile, so that it can be read over any image.
        const std::string label = labels[n].substr(0, std::max(0, (tile_width - 3) / letter_width));
        const int width = std::min(tile_width, static_cast<int>(label.size()) * letter_width + 3);
        for (int j = 0; j < std::min(letter_height + 4, tile_height); ++j) {
            std::fill_n(&sheet.pixels[static_cast<std::size_t>(top + j) * sheet.width + left], width, paper);
        }
        draw_text(sheet, left + 2, top + 2, label, ink);
    }
    return sheet;
}

}  // namespace render

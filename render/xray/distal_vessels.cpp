#include "render/xray/distal_vessels.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace render {
namespace {

/// Area of a disc's part between its edge at −radius and a line at u [px²].
float disc_part(float radius, float u) {
    if (u <= -radius) return 0.0f;
    const float whole = std::numbers::pi_v<float> * radius * radius;
    if (u >= radius) return whole;
    return u * std::sqrt(radius * radius - u * u) + radius * radius * std::asin(u / radius) + whole / 2;
}

/// From 0 before a blurred edge at 0 to 1 behind it.
float edge_at(float t, float half_width) {
    return std::clamp((t + half_width) / (2 * half_width), 0.0f, 1.0f);
}

constexpr float least_sine = 0.3f;  // of the angle between a piece and the ray

/// A piece on the image [pixels].
struct Projected {
    float x, y;  // of its start
    float along_x = 1, along_y = 0;
    float length, radius;
    float slant;           // [-]
    float depth_per_area;  // length of a ray [mm] for each px² of chord × px of width
};

}  // namespace

DistalVessels::DistalVessels(std::vector<VesselPiece> pieces, std::uint32_t nodes)
    : pieces_(std::move(pieces)), middle_(nodes, Vec3::Zero()) {
    std::vector<double> lengths(nodes, 0.0);
    for (const VesselPiece& piece : pieces_) {
        const bool fine = piece.from.allFinite() && piece.to.allFinite() && std::isfinite(piece.radius) &&
                          piece.radius > 0 && std::isfinite(piece.fill) && piece.fill >= 0;
        if (!fine || piece.node >= nodes)
            throw std::invalid_argument("a piece of a distal artery is not usable");
        const double length = (piece.to - piece.from).norm() + 1e-9;
        middle_[piece.node] += length * (piece.from + piece.to) / 2;
        lengths[piece.node] += length;
    }
    for (std::size_t n = 0; n < middle_.size(); ++n)
        if (lengths[n] > 0) middle_[n] /= lengths[n];
    std::stable_sort(pieces_.begin(), pieces_.end(),
                     [](const VesselPiece& a, const VesselPiece& b) { return a.node < b.node; });
}

DistalMatrix DistalVessels::at(const CArm& arm) const {
    DistalMatrix matrix;
    matrix.width = arm.pixels;
    matrix.middle = middle_;
    matrix.starts.push_back(0);
    const double pixel = pixel_width(arm);
    const auto width = static_cast<float>(arm.pixels);
    const auto close_nodes = [&](std::uint32_t before) {
        while (matrix.starts.size() <= before)
            matrix.starts.push_back(static_cast<std::uint32_t>(matrix.pixels.size()));
    };
    for (const VesselPiece& piece : pieces_) {
        close_nodes(piece.node);
        const Pixel a = project(arm, piece.from), b = project(arm, piece.to);
        if (a.depth <= 1 || b.depth <= 1) continue;
        const double scale = arm.sid / (0.5 * (a.depth + b.depth)) / pixel;  // [px/mm]
        Projected p{};
        p.x = static_cast<float>(a.x), p.y = static_cast<float>(a.y);
        p.radius = static_cast<float>(scale * piece.radius);
        const auto dx = static_cast<float>(b.x - a.x), dy = static_cast<float>(b.y - a.y);
        const float seen = std::hypot(dx, dy);
        if (seen > 1e-6f) p.along_x = dx / seen, p.along_y = dy / seen;
        const double whole = (piece.to - piece.from).norm();
        if (!(whole > 0)) continue;
        const auto volume = static_cast<float>(whole * scale);  // per px² of section
        // A piece along the ray would be a point.
        p.length = std::max(seen, least_sine * volume);
        p.depth_per_area = static_cast<float>(piece.fill / scale) * volume / p.length;
        // Its ends are seen at a slant: over this many pixels for each of half the chord.
        const Vec3 ray = ray_direction(arm, 0.5 * (a.x + b.x), 0.5 * (a.y + b.y));
        const double cosine = std::abs((piece.to - piece.from).dot(ray)) / whole;
        const double sine = std::max<double>(least_sine, std::sqrt(std::max(0.0, 1 - cosine * cosine)));
        p.slant = static_cast<float>(cosine / (sine * sine));
        const float reach = p.radius * (1 + p.slant) + 1;
        const float x1 = p.x + p.length * p.along_x, y1 = p.y + p.length * p.along_y;
        const float low_x = std::min(p.x, x1) - reach, high_x = std::max(p.x, x1) + reach,
                    low_y = std::min(p.y, y1) - reach, high_y = std::max(p.y, y1) + reach;
        if (!(high_x >= 0 && high_y >= 0 && low_x < width && low_y < width)) continue;
        const int first_x = static_cast<int>(std::max(0.0f, low_x)),
                  last_x = static_cast<int>(std::min(width - 1, high_x)),
                  first_y = static_cast<int>(std::max(0.0f, low_y)),
                  last_y = static_cast<int>(std::min(width - 1, high_y));
        for (int j = first_y; j <= last_y; ++j) {
            for (int i = first_x; i <= last_x; ++i) {
                const float u = static_cast<float>(i) + 0.5f - p.x, v = static_cast<float>(j) + 0.5f - p.y;
                const float along = u * p.along_x + v * p.along_y, across = v * p.along_x - u * p.along_y;
                if (std::abs(across) >= p.radius + 0.5f) continue;
                const float half = std::sqrt(std::max(0.0f, p.radius * p.radius - across * across));
                const float edge = 0.5f + half * p.slant;
                const float covered = edge_at(along, edge) - edge_at(along - p.length, edge);
                if (covered <= 0) continue;
                const float chord = disc_part(p.radius, across + 0.5f) - disc_part(p.radius, across - 0.5f);
                const float length = covered * chord * p.depth_per_area;
                if (length < 1e-5f) continue;
                matrix.pixels.push_back(static_cast<std::uint32_t>(j * arm.pixels + i));
                matrix.lengths.push_back(length);
            }
        }
    }
    close_nodes(nodes());
    return matrix;
}

void add_iodine(const DistalMatrix& matrix, std::span<const float> iodine, std::span<const PixelShift> shifts,
                Field& out, std::vector<std::uint32_t>& touched) {
    const int width = matrix.width;
    const auto add = [&](int x, int y, float amount) {
        if (x < 0 || y < 0 || x >= width || y >= width || amount == 0.0f) return;
        const auto pixel = static_cast<std::uint32_t>(y * width + x);
        float& there = out.values[pixel];
        if (there == 0.0f) touched.push_back(pixel);
        there += amount;
    };
    for (std::size_t n = 0; n + 1 < matrix.starts.size() && n < iodine.size(); ++n) {
        if (!(iodine[n] > 0.0f)) continue;
        const PixelShift shift = shifts.empty() ? PixelShift{} : shifts[n];
        const float x = std::clamp(shift.x, -1e4f, 1e4f), y = std::clamp(shift.y, -1e4f, 1e4f);
        const float left = std::floor(x), top = std::floor(y), right = x - left, down = y - top;
        for (std::uint32_t k = matrix.starts[n]; k < matrix.starts[n + 1]; ++k) {
            const int i = static_cast<int>(matrix.pixels[k]) % width + static_cast<int>(left),
                      j = static_cast<int>(matrix.pixels[k]) / width + static_cast<int>(top);
            const float amount = iodine[n] * matrix.lengths[k];
            add(i, j, amount * (1 - right) * (1 - down));
            add(i + 1, j, amount * right * (1 - down));
            add(i, j + 1, amount * (1 - right) * down);
            add(i + 1, j + 1, amount * right * down);
        }
    }
}

}  // namespace render

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
    float depth_per_area;  // length of a ray [mm] for each px² of chord × px of width
};

/// The plane that a piece ends at, as rays through the piece see it: how far from it, along its normal, the
/// middle of what a ray has of an endless piece lies.
struct End {
    float per_along, per_across;  // pixel [mm]
    float per_length;             // half of a mm of the ray's way in the piece [mm]
    float blur;                   // of half a pixel [mm]

    /// `whole`: of a piece [mm] that is `length` pixels long; `across`: one pixel to its left [mm].
    End(const Vec3& normal, const Vec3& axis, double whole, float length, const Vec3& across, const Vec3& ray)
        : per_along(static_cast<float>(normal.dot(axis) * whole / length)),
          per_across(static_cast<float>(normal.dot(across))),
          per_length(static_cast<float>(0.5 * std::abs(normal.dot(ray)))),
          blur(0.5f * std::max(std::abs(per_along), 1e-6f)) {}
    /// The part of the way that lies beyond it.
    float beyond(float along, float across, float way) const {
        return edge_at(per_along * along + per_across * across, blur + per_length * way);
    }
};

/// What the rays of one pixel have of one piece.
struct Passage {
    std::uint32_t pixel, node;
    float middle;   // depth [mm]
    float length;   // of the rays, were the piece endless [mm]
    float covered;  // fraction of those rays that it covers [-]
    float fill;     // [-]
};

/// Shares out a pixel's rays among pieces. Where pieces overlap in depth, as at a fork, each place counts
/// once: they take it in proportion to what they cover of it.
class Shares {
public:
    /// Calls add(passage, length of the rays in it that is its own [mm]).
    template <class Add>
    void of(std::span<const Passage> met, const Add& add) {
        if (met.size() == 1) return add(met[0], met[0].covered * met[0].length);
        bounds_.clear();
        for (const Passage& passage : met) {
            bounds_.push_back(passage.middle - passage.length / 2);
            bounds_.push_back(passage.middle + passage.length / 2);
        }
        std::sort(bounds_.begin(), bounds_.end());
        own_.assign(met.size(), 0.0f);
        for (std::size_t k = 0; k + 1 < bounds_.size(); ++k) {
            const float from = bounds_[k], to = bounds_[k + 1], between = (from + to) / 2;
            if (!(to > from)) continue;
            inside_.clear();
            float covered = 0;
            for (std::size_t i = 0; i < met.size(); ++i) {
                if (std::abs(between - met[i].middle) >= met[i].length / 2) continue;
                inside_.push_back(i);
                covered += met[i].covered;
            }
            const float part = (to - from) / std::max(1.0f, covered);
            for (const std::size_t i : inside_) own_[i] += part * met[i].covered;
        }
        for (std::size_t i = 0; i < met.size(); ++i) add(met[i], own_[i]);
    }

private:
    std::vector<float> bounds_, own_;
    std::vector<std::size_t> inside_;
};

/// In the order of keys that are below `count`; equal ones stay in sequence.
template <class Item, class Key>
std::vector<Item> sorted_by(const std::vector<Item>& items, std::size_t count, const Key& key) {
    std::vector<std::uint32_t> starts(count + 1, 0);
    for (const Item& item : items) ++starts[key(item) + 1];
    for (std::size_t k = 0; k < count; ++k) starts[k + 1] += starts[k];
    std::vector<Item> sorted(items.size());
    for (const Item& item : items) sorted[starts[key(item)]++] = item;
    return sorted;
}

}  // namespace

DistalVessels::DistalVessels(std::vector<VesselPiece> pieces, std::uint32_t nodes)
    : pieces_(std::move(pieces)), middle_(nodes, Vec3::Zero()) {
    std::vector<double> lengths(nodes, 0.0);
    for (const VesselPiece& piece : pieces_) {
        const bool fine = piece.from.allFinite() && piece.to.allFinite() && std::isfinite(piece.radius) &&
                          piece.radius > 0 && std::isfinite(piece.fill) && piece.fill >= 0;
        if (!fine || piece.node >= nodes)
            throw std::invalid_argument("a piece of a distal artery is not usable");
        const Vec3 from = piece.from.cast<double>(), to = piece.to.cast<double>();
        const double length = (to - from).norm() + 1e-9;
        middle_[piece.node] += length * (from + to) / 2;
        lengths[piece.node] += length;
    }
    for (std::size_t n = 0; n < middle_.size(); ++n)
        if (lengths[n] > 0) middle_[n] /= lengths[n];
    pieces_ = sorted_by(pieces_, nodes, [](const VesselPiece& piece) { return piece.node; });
}

DistalMatrix DistalVessels::at(const CArm& arm) const {
    const double pixel = pixel_width(arm);
    const auto width = static_cast<float>(arm.pixels);
    const ArmAxes detector = axes(arm);
    std::vector<Passage> passages;
    for (const VesselPiece& piece : pieces_) {
        const Vec3 from = piece.from.cast<double>(), to = piece.to.cast<double>();
        const Pixel a = project(arm, from), b = project(arm, to);
        if (a.depth <= 1 || b.depth <= 1) continue;
        const double scale = arm.sid / (0.5 * (a.depth + b.depth)) / pixel;  // [px/mm]
        Projected p{};
        p.x = static_cast<float>(a.x), p.y = static_cast<float>(a.y);
        p.radius = static_cast<float>(scale * piece.radius);
        const auto dx = static_cast<float>(b.x - a.x), dy = static_cast<float>(b.y - a.y);
        const float seen = std::hypot(dx, dy);
        if (seen > 1e-6f) p.along_x = dx / seen, p.along_y = dy / seen;
        const double whole = (to - from).norm();
        if (!(whole > 0)) continue;
        const auto volume = static_cast<float>(whole * scale);  // per px² of section
        // A piece along the ray would be a point.
        p.length = std::max(seen, least_sine * volume);
        p.depth_per_area = static_cast<float>(1 / scale) * volume / p.length;
        const Vec3 axis = (to - from) / whole, ray = ray_direction(arm, 0.5 * (a.x + b.x), 0.5 * (a.y + b.y)),
                   side = (-p.along_y * detector.right - p.along_x * detector.up) / scale;
        const auto normal = [&axis](const Eigen::Vector3f& given) {
            return given.isZero() ? axis : Vec3(given.cast<double>());
        };
        const End begin(normal(piece.begins), axis, whole, p.length, side, ray),
            end(normal(piece.ends), axis, whole, p.length, side, ray);
        // Its ends are seen at a slant.
        const auto oblique = [&](const End& plane) {
            return (std::abs(plane.per_across) * p.radius +
                    plane.per_length * 2 * p.radius * p.depth_per_area) /
                   std::max(std::abs(plane.per_along), 1e-3f);
        };
        const float reach = p.radius + 1 + std::min(std::max(oblique(begin), oblique(end)), 4 * p.radius);
        const float x1 = p.x + p.length * p.along_x, y1 = p.y + p.length * p.along_y;
        const float low_x = std::min(p.x, x1) - reach, high_x = std::max(p.x, x1) + reach,
                    low_y = std::min(p.y, y1) - reach, high_y = std::max(p.y, y1) + reach;
        if (!(high_x >= 0 && high_y >= 0 && low_x < width && low_y < width)) continue;
        const int first_x = static_cast<int>(std::max(0.0f, low_x)),
                  last_x = static_cast<int>(std::min(width - 1, high_x)),
                  first_y = static_cast<int>(std::max(0.0f, low_y)),
                  last_y = static_cast<int>(std::min(width - 1, high_y));
        const auto depth = static_cast<float>(a.depth),
                   deeper = static_cast<float>(b.depth - a.depth) / p.length;
        for (int j = first_y; j <= last_y; ++j) {
            for (int i = first_x; i <= last_x; ++i) {
                const float u = static_cast<float>(i) + 0.5f - p.x, v = static_cast<float>(j) + 0.5f - p.y;
                const float along = u * p.along_x + v * p.along_y, across = v * p.along_x - u * p.along_y;
                if (std::abs(across) >= p.radius + 0.5f) continue;
                const float chord = disc_part(p.radius, across + 0.5f) - disc_part(p.radius, across - 0.5f);
                const float length = chord * p.depth_per_area;
                const float covered =
                    begin.beyond(along, across, length) - end.beyond(along - p.length, across, length);
                if (covered <= 0) continue;
                if (covered * length < 1e-5f) continue;
                passages.push_back({static_cast<std::uint32_t>(j * arm.pixels + i), piece.node,
                                    depth + along * deeper, length, covered, piece.fill});
            }
        }
    }
    const auto all = static_cast<std::size_t>(arm.pixels) * static_cast<std::size_t>(arm.pixels);
    passages = sorted_by(passages, all, [](const Passage& passage) { return passage.pixel; });
    struct Entry {
        std::uint32_t pixel, node;
        float length;
    };
    std::vector<Entry> entries;
    entries.reserve(passages.size());
    Shares shares;
    for (std::size_t first = 0, past = 0; first < passages.size(); first = past) {
        while (past < passages.size() && passages[past].pixel == passages[first].pixel) ++past;
        const std::size_t before = entries.size();
        shares.of(std::span(passages).subspan(first, past - first), [&](const Passage& of, float length) {
            length *= of.fill;
            if (!(length > 0)) return;
            for (std::size_t k = before; k < entries.size(); ++k)
                if (entries[k].node == of.node) {
                    entries[k].length += length;
                    return;
                }
            entries.push_back({of.pixel, of.node, length});
        });
    }
    entries = sorted_by(entries, nodes(), [](const Entry& entry) { return entry.node; });

    DistalMatrix matrix;
    matrix.width = arm.pixels;
    matrix.middle = middle_;
    matrix.starts.assign(std::size_t{nodes()} + 1, 0);
    for (const Entry& entry : entries) {
        ++matrix.starts[entry.node + 1];
        matrix.pixels.push_back(entry.pixel);
        matrix.lengths.push_back(entry.length);
    }
    for (std::size_t n = 0; n < nodes(); ++n) matrix.starts[n + 1] += matrix.starts[n];
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
        if (shift.x == 0.0f && shift.y == 0.0f) {
            for (std::uint32_t k = matrix.starts[n]; k < matrix.starts[n + 1]; ++k) {
                float& there = out.values[matrix.pixels[k]];
                if (there == 0.0f) touched.push_back(matrix.pixels[k]);
                there += iodine[n] * matrix.lengths[k];
            }
            continue;
        }
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

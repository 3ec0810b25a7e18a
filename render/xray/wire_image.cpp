#include "render/xray/wire_image.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "render/picture/fast_math.h"

namespace render {
namespace {

constexpr double longest = 1e3;  // longest chord that counts, for any wire [mm]

/// Points of a cardinal spline through the joints, so close that a chord strays by at most 0.01 mm.
Polyline smooth(std::span<const Vec3> joints) {
    const int last = static_cast<int>(joints.size()) - 1;
    const auto turn = [&](int i) {  // at joint i [rad]
        if (i <= 0 || i >= last) return 0.0;
        const Vec3 a = joints[i] - joints[i - 1], b = joints[i + 1] - joints[i];
        return std::atan2(a.cross(b).norm(), a.dot(b));
    };
    const auto slope = [&](int i) -> Vec3 {
        const int before = std::max(i - 1, 0), after = std::min(i + 1, last);
        return (joints[after] - joints[before]) / (after - before);
    };
    Polyline points{joints[0]};
    for (int i = 0; i < last; ++i) {
        const double bend = std::max(turn(i), turn(i + 1));
        const double length = (joints[i + 1] - joints[i]).norm();
        const int pieces =
            static_cast<int>(std::max(1.0, std::min(16.0, std::ceil(std::sqrt(length * bend / 0.08)))));
        const Vec3 m0 = slope(i), m1 = slope(i + 1);
        for (int k = 1; k < pieces; ++k) {
            const double t = double(k) / pieces, t2 = t * t, t3 = t2 * t;
            points.push_back((2 * t3 - 3 * t2 + 1) * joints[i] + (t3 - 2 * t2 + t) * m0 +
                             (3 * t2 - 2 * t3) * joints[i + 1] + (t3 - t2) * m1);
        }
        points.push_back(joints[i + 1]);
    }
    return points;
}

/// Puts a corner where the marker begins; returns the index of that corner.
int split_at_marker(Polyline& points, double marker_length) {
    double left = marker_length;
    for (int i = static_cast<int>(points.size()) - 1; i > 0; --i) {
        const double length = (points[i] - points[i - 1]).norm();
        if (left <= 0.0) return i;
        if (left < length) {
            const Vec3 start = points[i] + (left / length) * (points[i - 1] - points[i]);
            points.insert(points.begin() + i, start);
            return i;
        }
        left -= length;
    }
    return 0;
}

}  // namespace

WireAttenuation wire_attenuation(const WireLook& look, const EnergyBins& bins, const Bins& displaced) {
    const Bins body = bins.attenuation(look.body), marker = bins.attenuation(look.marker),
               core = bins.attenuation(look.core);
    WireAttenuation result;
    for (int k = 0; k < energy_bins; ++k) {
        result.body[k] = look.body_fill * body[k] - displaced[k];
        result.marker[k] = look.marker_fill * marker[k] - displaced[k];
        result.core[k] = core[k] - displaced[k];
    }
    return result;
}

/// A cylinder between two mitre planes. Coordinates: x right, y down, z depth, origin at the source [mm].
struct WireImage::Piece {
    Vec3 from, to;
    Vec3 axis;                          // unit
    Vec3 mitre_from, mitre_to;          // unit normals of the planes, along the wire
    double radius = 0.0, inside = 0.0;  // of the part; what is inside belongs to another, or to none
    bool cored = false;                 // what is inside is the core
    double spread = 1;                  // of a pixel's places, over the pixel's own width
    float contents = 0;                 // of the bore: iodine more than in what the device displaces [mg/ml]
    int part = 0;                       // of Slot::chords
    int core = 0;
    // Values common to all rays, set by `prepare`.
    double offset = 0.0, c = 0.0, c_inside = 0.0, level_from = 0.0, level_to = 0.0;

    void prepare() {
        offset = from.dot(axis);
        c = from.squaredNorm() - offset * offset - radius * radius;
        c_inside = c + radius * radius - inside * inside;
        level_from = from.dot(mitre_from);
        level_to = to.dot(mitre_to);
    }

    /// Length of the ray source + t·direction in the cylinder that `level`, a c, belongs to [mm]; `direction`
    /// has depth 1.
    double chord(const Vec3& direction, double level) const {
        const double along = direction.dot(axis), square = direction.squaredNorm();
        const double a = square - along * along;
        const double b = from.dot(direction) - offset * along;
        double enter, leave;
        if (a > 1e-12 * square) {
            const double discriminant = b * b - a * level;
            if (discriminant <= 0.0) return 0.0;
            const double half = std::sqrt(discriminant) / a;
            enter = b / a - half;
            leave = b / a + half;
        } else {  // parallel to the axis: inside everywhere or nowhere
            if (level >= 0.0) return 0.0;
            enter = 0.0;
            leave = 1e9;
        }
        clip(direction.dot(mitre_from), level_from, enter, leave);
        clip(-direction.dot(mitre_to), -level_to, enter, leave);
        return leave > enter ? (leave - enter) * std::sqrt(square) : 0.0;
    }

    /// Keeps the part of [enter, leave] where t·rate ≥ level.
    static void clip(double rate, double level, double& enter, double& leave) {
        if (rate > 1e-15) {
            enter = std::max(enter, level / rate);
        } else if (rate < -1e-15) {
            leave = std::min(leave, level / rate);
        } else if (level > 0.0) {
            leave = enter;
        }
    }
};

WireImage::Slot& WireImage::slot(std::uint32_t pixel) {
    std::int32_t& index = slot_of_pixel_[pixel];
    if (index < 0) {
        index = static_cast<std::int32_t>(slots_.size());
        slots_.emplace_back();
        slots_.back().pixel = pixel;
    }
    return slots_[index];
}

/// `scale` converts x/z to sample places; place (u, v) stands at (u + ½, v + ½) from the upper left corner.
void WireImage::splat(const Piece& piece, int pixels, double scale) {
    const int places = pixels * samples;
    const double centre = 0.5 * places;
    const Eigen::Vector2d a(scale * piece.from.x() / piece.from.z(), scale * piece.from.y() / piece.from.z());
    const Eigen::Vector2d b(scale * piece.to.x() / piece.to.z(), scale * piece.to.y() / piece.to.z());
    const double length = (b - a).norm();
    const Eigen::Vector2d along =
        length > 1e-9 ? Eigen::Vector2d((b - a) / length) : Eigen::Vector2d(1.0, 0.0);
    const Eigen::Vector2d across(-along.y(), along.x());
    // Reach of the shadow around the projected axis: its half-width, and beyond the ends the tilted end disc
    // and the mitre. One more place covers the perspective of the silhouette.
    const double nearest = std::min(piece.from.z(), piece.to.z()) - piece.radius;
    const double moved = samples * unsharp_.motion.norm();
    const double reach =
        1.02 * scale * piece.radius / nearest + 1.0 + 0.5 * samples * (piece.spread - 1) + 0.5 * moved;
    const auto overhang = [&](const Vec3& mitre) {
        const double cosine = std::max(0.3, mitre.dot(piece.axis));
        return reach * (std::abs(piece.axis.z()) + std::sqrt(1.0 - std::min(1.0, cosine * cosine)) / cosine) +
               1.0;
    };
    const double before = overhang(piece.mitre_from), after = overhang(piece.mitre_to);

    const double top = std::min(a.y(), b.y()) - reach - before - after + centre;
    const double bottom = std::max(a.y(), b.y()) + reach + before + after + centre;
    if (!(bottom > 0.0 && top < places)) return;
    // Of place (u, v), from the upper left corner [places].
    const auto place_of = [&](int u, int v, double spread) -> Eigen::Vector2d {
        const int column = u % samples, row = v % samples;
        const double middle = 0.5 * samples;
        const Eigen::Vector2d pixel(u - column + middle, v - row + middle);
        // The time of the place, in an order that goes with neither axis.
        const double time =
            ((row * samples + column) * 7 % (samples * samples) + 0.5) / (samples * samples) - 0.5;
        return pixel + spread * Eigen::Vector2d(column + 0.5 - middle, row + 0.5 - middle) +
               samples * time * unsharp_.motion;
    };
    const int first_row = static_cast<int>(std::max(0.0, std::floor(top)));
    const int last_row = static_cast<int>(std::min(places - 1.0, std::ceil(bottom)));
    for (int v = first_row; v <= last_row; ++v) {
        const double y = v + 0.5 - centre;  // without unsharpness
        double left = -centre, right = centre;
        // Narrows [left, right] to low ≤ d·(p − a) ≤ high on this row.
        const auto narrow = [&](const Eigen::Vector2d& d, double low, double high) {
            const double rest = d.y() * (y - a.y()) - d.x() * a.x();
            if (std::abs(d.x()) < 1e-9) {
                if (rest < low || rest > high) right = left - 1.0;
                return;
            }
            const double p = (low - rest) / d.x(), q = (high - rest) / d.x();
            left = std::max(left, std::min(p, q));
            right = std::min(right, std::max(p, q));
        };
        narrow(across, -reach, reach);
        narrow(along, -before, length + after);
        if (right < left) continue;
        const int first = std::max(0, static_cast<int>(std::floor(left + centre)));
        const int last = std::min(places - 1, static_cast<int>(std::ceil(right + centre)));
        const std::uint32_t row = static_cast<std::uint32_t>(v / samples) * pixels;
        for (int u = first; u <= last; ++u) {
            const int place = v % samples * samples + u % samples;
            const Eigen::Vector2d at = place_of(u, v, piece.spread);
            const Vec3 ray((at.x() - centre) / scale, (at.y() - centre) / scale, 1.0);
            const double chord = piece.chord(ray, piece.c);
            if (!(chord > 0.0)) continue;
            const double within = piece.inside > 0 ? piece.chord(ray, piece.c_inside) : 0.0;
            Slot& hit = slot(row + u / samples);
            hit.chords[piece.part][place] += static_cast<float>(std::min(chord - within, longest));
            if (piece.cored) hit.chords[piece.core][place] += static_cast<float>(std::min(within, longest));
            hit.iodine[place] += piece.contents * static_cast<float>(std::min(within, longest));
        }
    }
}

std::span<const WirePixel> WireImage::cast(const CArm& arm, std::span<const Vec3> joints,
                                           const WireLook& look, const WireAttenuation& mu) {
    const WireShadow one[] = {{joints, look, mu}};
    return cast(arm, one);
}

void WireImage::splat_device(const CArm& arm, const WireShadow& shadow, int device) {
    const WireLook& look = shadow.look;
    const auto finite = [](const Vec3& x) { return x.allFinite(); };
    if (shadow.joints.size() < 2 || !std::all_of(shadow.joints.begin(), shadow.joints.end(), finite)) return;
    Polyline points = smooth(shadow.joints);
    // Coincident joints would have no direction.
    points.erase(std::unique(points.begin(), points.end(),
                             [](const Vec3& a, const Vec3& b) { return (a - b).squaredNorm() < 1e-18; }),
                 points.end());
    if (points.size() < 2) return;
    const int marker_start = look.marker_length > 0.0 ? split_at_marker(points, look.marker_length)
                                                      : static_cast<int>(points.size());
    const ArmAxes a = axes(arm);
    for (Vec3& p : points) {
        const Vec3 from = p - arm.isocentre;
        p = Vec3(a.right.dot(from), -a.up.dot(from), arm.sod + a.beam.dot(from));
    }
    const double scale = arm.sid / pixel_width(arm) * samples;
    const int pieces = static_cast<int>(points.size()) - 1;
    const auto direction = [&](int i) -> Vec3 { return (points[i + 1] - points[i]).normalized(); };
    std::vector<float> contents(static_cast<std::size_t>(pieces), 0.0f);
    if (shadow.iodine && look.inner_diameter > 0 && look.core_diameter <= 0) {
        const DeviceIodine& iodine = *shadow.iodine;
        const auto parts_of_bore = static_cast<double>(iodine.bore.size());
        double from_end = 0;
        for (int i = pieces - 1; i >= 0; --i) {
            const double length = (points[i + 1] - points[i]).norm();
            const double place =
                (1 - (from_end + 0.5 * length) / std::max(iodine.length, 1e-9)) * parts_of_bore;
            const double in =
                iodine.bore.empty()
                    ? 0.0
                    : iodine.bore[static_cast<std::size_t>(std::clamp(place, 0.0, parts_of_bore - 1))];
            contents[static_cast<std::size_t>(i)] = static_cast<float>(in - iodine.around);
            from_end += length;
        }
        contents_ = contents_ || !iodine.bore.empty() || iodine.around != 0;
    }
    Piece piece;
    piece.radius = 0.5 * look.diameter;
    piece.cored = look.core_diameter > 0;
    piece.inside = 0.5 * (piece.cored ? look.core_diameter : look.inner_diameter);
    piece.core = parts * device + 2;
    piece.axis = direction(0);
    piece.mitre_from = piece.axis;
    for (int i = 0; i < pieces; ++i) {
        const Vec3 next = i + 1 < pieces ? direction(i + 1) : piece.axis;
        const Vec3 sum = piece.axis + next;
        // A wire folded back on itself has no sensible mitre: it ends square and starts again.
        const bool folded = sum.norm() < 0.6;
        piece.from = points[i];
        piece.to = points[i + 1];
        piece.mitre_to = folded ? piece.axis : Vec3(sum.normalized());
        piece.part = parts * device + (i >= marker_start ? 1 : 0);
        piece.contents = contents[static_cast<std::size_t>(i)];
        piece.prepare();
        // Squares of this width and a pixel's together.
        const double depth = 0.5 * (piece.from.z() + piece.to.z()),
                     spot = unsharp_.focal_spot * (arm.sid / depth - 1) / pixel_width(arm);
        piece.spread = std::sqrt(1 + spot * spot);
        if (std::min(piece.from.z(), piece.to.z()) > 10.0 * piece.radius + 1.0)
            splat(piece, arm.pixels, scale);
        piece.mitre_from = folded ? next : piece.mitre_to;
        piece.axis = next;
    }
}

std::span<const WirePixel> WireImage::cast(const CArm& arm, std::span<const WireShadow> shadows,
                                           const Bins& per_iodine, const Unsharpness& unsharp) {
    contents_ = false;
    unsharp_ = unsharp;
    result_.clear();
    slots_.clear();
    slot_of_pixel_.resize(static_cast<std::size_t>(arm.pixels) * arm.pixels, -1);
    const int devices = std::min(static_cast<int>(shadows.size()), most_devices);
    for (int d = 0; d < devices; ++d) splat_device(arm, shadows[d], d);

    for (const Slot& hit : slots_) {
        WirePixel pixel{hit.pixel, {}};
        for (int k = 0; k < energy_bins; ++k) {
            std::array<float, per_pixel> depth{};
            for (int d = 0; d < devices; ++d) {
                const float body = static_cast<float>(-shadows[d].attenuation.body[k]);
                const float marker = static_cast<float>(-shadows[d].attenuation.marker[k]);
                const auto &bodies = hit.chords[parts * d], &markers = hit.chords[parts * d + 1];
                for (int s = 0; s < per_pixel; ++s) depth[s] += body * bodies[s] + marker * markers[s];
                if (shadows[d].look.core_diameter <= 0) continue;
                const float core = static_cast<float>(-shadows[d].attenuation.core[k]);
                for (int s = 0; s < per_pixel; ++s) depth[s] += core * hit.chords[parts * d + 2][s];
            }
            if (contents_) {
                const auto iodine = static_cast<float>(-per_iodine[k]);
                for (int s = 0; s < per_pixel; ++s) depth[s] += iodine * hit.iodine[s];
            }
            float sum = 0.0f;
            for (float& d : depth) d = fast_exp(d);
            for (const float fraction : depth) sum += fraction;
            pixel.transmission[k] = sum / per_pixel;
        }
        result_.push_back(pixel);
        slot_of_pixel_[hit.pixel] = -1;
    }
    return result_;
}

}  // namespace render

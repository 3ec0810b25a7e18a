#include "render/xray/wire_image.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "render/picture/fast_math.h"

namespace render {
namespace {

constexpr double longest = 1e3;  // longest chord that counts, for any wire [mm]

/// A line, and where it has radii the radius at each of its points [mm].
struct Swept {
    Polyline points;
    std::vector<double> radii = {};
};

/// Points of a cardinal spline through the joints, so close that a chord strays by at most 0.01 mm.
Swept smooth(std::span<const Vec3> joints, std::span<const double> radii) {
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
    Swept line{{joints[0]}};
    Polyline& points = line.points;
    if (!radii.empty()) line.radii.push_back(radii[0]);
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
        if (radii.empty()) continue;
        for (int k = 1; k <= pieces; ++k)
            line.radii.push_back(radii[i] + double(k) / pieces * (radii[i + 1] - radii[i]));
    }
    return line;
}

/// Takes out points that lie on those before them: between these there is no direction.
void drop_repeated(Swept& line) {
    const auto same = [](const Vec3& a, const Vec3& b) { return (a - b).squaredNorm() < 1e-18; };
    if (!line.radii.empty()) {
        std::size_t kept = 0;
        for (std::size_t i = 1; i < line.radii.size(); ++i)
            if (!same(line.points[kept], line.points[i])) {
                line.points[++kept] = line.points[i];
                line.radii[kept] = line.radii[i];
            }
        line.radii.resize(kept + 1);
        line.points.resize(kept + 1);
    }
    line.points.erase(std::unique(line.points.begin(), line.points.end(), same), line.points.end());
}

/// Puts a corner where the marker begins; returns the index of that corner.
int split_at_marker(Swept& line, double marker_length) {
    Polyline& points = line.points;
    double left = marker_length;
    for (int i = static_cast<int>(points.size()) - 1; i > 0; --i) {
        const double length = (points[i] - points[i - 1]).norm();
        if (left <= 0.0) return i;
        if (left < length) {
            const Vec3 start = points[i] + (left / length) * (points[i - 1] - points[i]);
            points.insert(points.begin() + i, start);
            if (std::vector<double>& r = line.radii; !r.empty())
                r.insert(r.begin() + i, r[i] + (left / length) * (r[i - 1] - r[i]));
            return i;
        }
        left -= length;
    }
    return 0;
}

/// Takes out points that the line and its radii go past within `tolerance` without them [mm]: each piece of a
/// wide device reaches far over its ends where it is seen at an angle, and few long ones are cast faster.
void simplify(Swept& line, double tolerance) {
    constexpr std::size_t most = 50;  // pieces that become one
    const auto fits = [&](std::size_t a, std::size_t b) {
        const Vec3 way = line.points[b] - line.points[a];
        for (std::size_t i = a + 1; i < b; ++i) {
            const double t = std::clamp(
                (line.points[i] - line.points[a]).dot(way) / std::max(1e-18, way.squaredNorm()), 0.0, 1.0);
            if ((line.points[a] + t * way - line.points[i]).norm() > tolerance ||
                std::abs(line.radii[a] + t * (line.radii[b] - line.radii[a]) - line.radii[i]) > tolerance)
                return false;
        }
        return true;
    };
    const std::size_t last = line.points.size() - 1;
    std::size_t kept = 0, from = 0;
    while (from < last) {
        std::size_t to = from + 1;
        while (to < last && to - from < most && fits(from, to + 1)) ++to;
        ++kept;
        line.points[kept] = line.points[to];
        line.radii[kept] = line.radii[to];
        from = to;
    }
    line.points.resize(kept + 1);
    line.radii.resize(kept + 1);
}

/// The part between two distances from the line's end [mm]; empty where it does not reach there.
Swept part_of(const Swept& line, double from_end, double to_end) {
    Swept part;
    const auto add = [&](std::size_t i,
                         double t) {  // at fraction t of the way from point i to the one before
        part.points.push_back(line.points[i] + t * (line.points[i - 1] - line.points[i]));
        if (!line.radii.empty())
            part.radii.push_back(line.radii[i] + t * (line.radii[i - 1] - line.radii[i]));
    };
    double gone = 0;
    for (std::size_t i = line.points.size() - 1; i > 0 && gone < to_end; --i) {
        const double length = (line.points[i] - line.points[i - 1]).norm(), end = gone + length;
        if (end > from_end) {
            if (part.points.empty()) add(i, std::max(0.0, (from_end - gone) / length));
            add(i, std::min(1.0, (to_end - gone) / length));
        }
        gone = end;
    }
    std::reverse(part.points.begin(), part.points.end());
    std::reverse(part.radii.begin(), part.radii.end());
    drop_repeated(part);
    return part;
}

}  // namespace

WireAttenuation wire_attenuation(const WireLook& look, const EnergyBins& bins, const Bins& displaced) {
    const Bins body = bins.attenuation(look.body), marker = bins.attenuation(look.marker),
               core = bins.attenuation(look.core), platinum = bins.attenuation(Material::Platinum);
    WireAttenuation result;
    for (int k = 0; k < energy_bins; ++k) {
        result.body[k] = look.body_fill * body[k] - displaced[k];
        result.marker[k] = look.marker_fill * marker[k] - displaced[k];
        result.core[k] = core[k] - displaced[k];
        result.band[k] = platinum[k] - displaced[k];
    }
    return result;
}

/// A cylinder, or a piece of a cone, between two mitre planes. Coordinates: x right, y down, z depth, origin
/// at the source [mm].
struct WireImage::Piece {
    Vec3 from = Vec3::Zero(), to = Vec3::Zero();
    Vec3 axis = Vec3::Zero();                                 // unit
    Vec3 mitre_from = Vec3::Zero(), mitre_to = Vec3::Zero();  // unit normals of the planes, along the wire
    double radius = 0.0, inside = 0.0;  // of the part; what is inside belongs to another, or to none
    double axle = 0.0;                  // radius of what is inside and not filled
    bool cone = false;                  // its radii, `radius` the largest, follow from `outer` and `inner`
    bool cored = false;                 // what is inside is the core
    double spread = 1;                  // of a pixel's places, over the pixel's own width
    float contents = 0;                 // of the bore: iodine more than in what the device displaces [mg/ml]
    Part part = Body;
    /// A surface whose radius is linear along the axis.
    struct Cone {
        double at_from, at_to;  // radius [mm]
        double at_source = 0, slope = 0, c = 0;
    };
    Cone outer{}, inner{};
    // Values common to all rays, set by `prepare`.
    double offset = 0.0, c = 0.0, c_inside = 0.0, c_axle = 0.0, level_from = 0.0, level_to = 0.0;

    void prepare() {
        offset = from.dot(axis);
        c = from.squaredNorm() - offset * offset - radius * radius;
        c_inside = c + radius * radius - inside * inside;
        c_axle = c + radius * radius - axle * axle;
        level_from = from.dot(mitre_from);
        level_to = to.dot(mitre_to);
        if (!cone) return;
        for (Cone* surface : {&outer, &inner}) {
            surface->slope = (surface->at_to - surface->at_from) / (to - from).norm();
            surface->at_source = surface->at_from - surface->slope * offset;
            surface->c = from.squaredNorm() - offset * offset - surface->at_source * surface->at_source;
        }
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

    /// The same in a cone, whose radius along the ray is at_source + t·growth.
    double chord(const Vec3& direction, const Cone& surface) const {
        const double along = direction.dot(axis), square = direction.squaredNorm();
        const double growth = surface.slope * along;
        const double a = square - along * along - growth * growth;
        const double b = from.dot(direction) - offset * along + surface.at_source * growth;
        // Inside is where a t² − 2 b t + c ≤ 0, and the radius is not negative: there is a second cone beyond
        // the apex.
        const double discriminant = b * b - a * surface.c;
        double enter = 0.0, leave = 1e9;
        if (a > 1e-12 * square) {
            if (discriminant <= 0.0) return 0.0;
            const double half = std::sqrt(discriminant) / a;
            enter = b / a - half;
            leave = b / a + half;
        } else if (a <
                   -1e-12 * square) {  // steeper than the surface: from where it enters, or until it leaves
            const double half = std::sqrt(std::max(0.0, discriminant)) / -a;
            if (growth > 0.0)
                enter = std::max(enter, b / a + half);
            else
                leave = std::min(leave, b / a - half);
        } else {
            clip(2 * b, surface.c, enter, leave);
        }
        clip(growth, -surface.at_source, enter, leave);
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

WireImage::Chords& WireImage::chords(Slot& hit) {
    const auto layer = static_cast<std::int32_t>(layers_.size()) - 1;
    if (hit.last < 0 || chords_[hit.last].layer != layer) {
        const auto index = static_cast<std::int32_t>(chords_.size());
        (hit.last < 0 ? hit.first : chords_[hit.last].next) = index;
        hit.last = index;
        chords_.push_back({layer});
    }
    return chords_[hit.last];
}

/// `scale` converts x/z to sample places; place (u, v) stands at (u + ½, v + ½) from the upper left corner.
template <bool cone>
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
        int known = -1;  // the column of `hit` and `of`
        Slot* hit = nullptr;
        Chords* of = nullptr;
        for (int u = first; u <= last; ++u) {
            const int place = v % samples * samples + u % samples;
            const Eigen::Vector2d at = place_of(u, v, piece.spread);
            const Vec3 ray((at.x() - centre) / scale, (at.y() - centre) / scale, 1.0);
            const double chord = cone ? piece.chord(ray, piece.outer) : piece.chord(ray, piece.c);
            if (!(chord > 0.0)) continue;
            double within = 0.0, filled = 0.0;
            if (piece.inside > 0) {
                within = piece.inside >= piece.radius ? chord
                         : cone                       ? piece.chord(ray, piece.inner)
                                                      : piece.chord(ray, piece.c_inside);
                filled = piece.axle > 0 ? std::max(0.0, within - piece.chord(ray, piece.c_axle)) : within;
            }
            if (const int column = u / samples; column != known) {
                known = column;
                hit = &slot(row + column);
                of = &chords(*hit);
            }
            of->of[piece.part][place] += static_cast<float>(std::min(chord - within, longest));
            if (piece.cored) of->of[Core][place] += static_cast<float>(std::min(within, longest));
            hit->iodine[place] += piece.contents * static_cast<float>(std::min(filled, longest));
        }
    }
}

std::span<const WirePixel> WireImage::cast(const CArm& arm, std::span<const Vec3> joints,
                                           const WireLook& look, const WireAttenuation& mu) {
    const WireShadow one[] = {{joints, look, mu}};
    return cast(arm, one);
}

/// A device or a part of it, in the coordinates of a piece.
struct WireImage::Course {
    Polyline points;
    int marker_start;                // the piece with which the marker begins
    std::vector<float> contents;     // of each piece: Piece::contents; empty = 0
    std::vector<double> outer = {};  // radius at each point; empty = the piece's own [mm]
    std::vector<double> inner = {};
};

/// `piece`: what all have in common.
void WireImage::splat_course(const CArm& arm, const Course& course, Piece piece) {
    const Polyline& points = course.points;
    const double scale = arm.sid / pixel_width(arm) * samples;
    const int pieces = static_cast<int>(points.size()) - 1;
    const auto direction = [&](int i) -> Vec3 { return (points[i + 1] - points[i]).normalized(); };
    const bool varies = !course.outer.empty();
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
        piece.part = i >= course.marker_start ? Marker : Body;
        if (!course.contents.empty()) piece.contents = course.contents[static_cast<std::size_t>(i)];
        if (varies) {
            piece.outer = {course.outer[i], course.outer[i + 1]};
            piece.inner = {course.inner[i], course.inner[i + 1]};
            piece.radius = std::max(piece.outer.at_from, piece.outer.at_to);
            piece.inside = std::max(piece.inner.at_from, piece.inner.at_to);
            piece.cone = std::min(piece.outer.at_from, piece.outer.at_to) < piece.radius;
        }
        piece.prepare();
        // Squares of this width and a pixel's together.
        const double depth = 0.5 * (piece.from.z() + piece.to.z()),
                     spot = unsharp_.focal_spot * (arm.sid / depth - 1) / pixel_width(arm);
        piece.spread = std::sqrt(1 + spot * spot);
        if (std::min(piece.from.z(), piece.to.z()) > 10.0 * piece.radius + 1.0)
            piece.cone ? splat<true>(piece, arm.pixels, scale) : splat<false>(piece, arm.pixels, scale);
        piece.mitre_from = folded ? next : piece.mitre_to;
        piece.axis = next;
    }
}

void WireImage::splat_device(const CArm& arm, const WireShadow& shadow) {
    const WireLook& look = shadow.look;
    const auto finite = [](const Vec3& x) { return x.allFinite(); };
    if (shadow.joints.size() < 2 || !std::all_of(shadow.joints.begin(), shadow.joints.end(), finite)) return;
    const bool varies = !shadow.radii.empty();
    if (varies && (shadow.radii.size() != shadow.joints.size() ||
                   !std::all_of(shadow.radii.begin(), shadow.radii.end(),
                                [](double r) { return r >= 0 && std::isfinite(r); })))
        return;
    Swept line = shadow.straight ? Swept{Polyline(shadow.joints.begin(), shadow.joints.end()),
                                         {shadow.radii.begin(), shadow.radii.end()}}
                                 : smooth(shadow.joints, shadow.radii);
    drop_repeated(line);
    if (line.points.size() < 2) return;
    if (varies && (!shadow.iodine || shadow.iodine->bore.size() <= 1)) simplify(line, 0.01);
    const int marker_start = look.marker_length > 0.0 ? split_at_marker(line, look.marker_length)
                                                      : static_cast<int>(line.points.size());
    const ArmAxes a = axes(arm);
    for (Vec3& p : line.points) {
        const Vec3 from = p - arm.isocentre;
        p = Vec3(a.right.dot(from), -a.up.dot(from), arm.sod + a.beam.dot(from));
    }
    const Polyline& points = line.points;
    const int pieces = static_cast<int>(points.size()) - 1;
    std::vector<float> contents(static_cast<std::size_t>(pieces), 0.0f);
    if (shadow.iodine && look.inner_diameter > 0 && (look.core_diameter <= 0 || varies)) {
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
    const auto scaled = [&](double by) {
        std::vector<double> radii = line.radii;
        for (double& r : radii) r *= by;
        return radii;
    };
    Piece piece;
    piece.radius = 0.5 * look.diameter;
    piece.cored = look.core_diameter > 0 && !varies;
    piece.inside = 0.5 * (piece.cored ? look.core_diameter : look.inner_diameter);
    piece.axle = varies ? 0.5 * look.core_diameter : 0.0;
    layers_.push_back({shadow.attenuation, piece.cored});
    splat_course(
        arm,
        {points, marker_start, std::move(contents), line.radii, scaled(look.inner_diameter / look.diameter)},
        piece);
    if (look.bands.empty()) return;
    WireAttenuation platinum;
    platinum.body = shadow.attenuation.band;
    layers_.push_back({platinum, false});
    Piece ring;
    ring.inside = 0.5 * look.diameter;
    ring.radius = ring.inside + WireLook::band_thickness;
    for (const double middle : look.bands) {
        Swept part =
            part_of(line, middle - 0.5 * WireLook::band_length, middle + 0.5 * WireLook::band_length);
        if (part.points.size() < 2) continue;
        std::vector<double> outer = part.radii;
        for (double& r : outer) r += WireLook::band_thickness;
        const auto none = static_cast<int>(part.points.size());
        splat_course(arm, {std::move(part.points), none, {}, std::move(outer), std::move(part.radii)}, ring);
    }
}

std::span<const WirePixel> WireImage::cast(const CArm& arm, std::span<const WireShadow> shadows,
                                           const Bins& per_iodine, const Unsharpness& unsharp) {
    contents_ = false;
    unsharp_ = unsharp;
    result_.clear();
    slots_.clear();
    chords_.clear();
    layers_.clear();
    slot_of_pixel_.resize(static_cast<std::size_t>(arm.pixels) * arm.pixels, -1);
    for (const WireShadow& shadow : shadows) splat_device(arm, shadow);

    for (const Slot& hit : slots_) {
        WirePixel pixel{hit.pixel, {}};
        for (int k = 0; k < energy_bins; ++k) {
            Places depth{};
            for (std::int32_t next = hit.first; next >= 0; next = chords_[next].next) {
                const Chords& of = chords_[next];
                const Layer& layer = layers_[of.layer];
                const float body = static_cast<float>(-layer.attenuation.body[k]);
                const float marker = static_cast<float>(-layer.attenuation.marker[k]);
                for (int s = 0; s < per_pixel; ++s)
                    depth[s] += body * of.of[Body][s] + marker * of.of[Marker][s];
                if (!layer.cored) continue;
                const float core = static_cast<float>(-layer.attenuation.core[k]);
                for (int s = 0; s < per_pixel; ++s) depth[s] += core * of.of[Core][s];
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

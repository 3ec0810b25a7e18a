#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "render/xray/signed_depths.h"

namespace render {
namespace {

using Eigen::Vector3f;

constexpr double least_depth = 1e-3;  // from the source [mm]; nearer parts of a face are cut off
constexpr double farthest = 8192.0;   // of corners from the image's middle [pixels]; the rest is cut off
constexpr int snaps = 256;            // per pixel

/// The stand in double precision.
struct Camera {
    Vec3 source, beam, right, down;
    double per_slope, centre;  // [pixels]

    explicit Camera(const CArm& arm) : source(render::source(arm)) {
        const ArmAxes axes = render::axes(arm);
        beam = axes.beam;
        right = axes.right;
        down = -axes.up;
        per_slope = arm.sid / pixel_width(arm);
        centre = 0.5 * arm.pixels;
    }
    /// To the right, down and away from the source [mm].
    Vec3 seen(const Vec3& place) const {
        const Vec3 from = place - source;
        return {right.dot(from), down.dot(from), beam.dot(from)};
    }
};

/// Where a corner is in the image.
struct Snapped {
    std::int32_t x = 0, y = 0;  // [1/256 pixel]
    bool there = false;         // in front of the source, and not too far from the middle
};

/// The half-plane on one side of an edge, edge included where it is an upper or left one, along a row of
/// pixels.
struct Edge {
    double x, y, start;  // inside is where x·i + y·j + start is not negative, in pixel (i, j)

    Edge(const Snapped& from, const Snapped& to) {
        const std::int64_t dx = std::int64_t{to.x} - from.x, dy = std::int64_t{to.y} - from.y;
        // dx·(Y − from.y) − dy·(X − from.x) is positive inside, and 0 on the edge.
        const bool kept = dy < 0 || (dy == 0 && dx > 0);
        const std::int64_t at_zero =
            dx * (snaps / 2 - std::int64_t{from.y}) - dy * (snaps / 2 - std::int64_t{from.x});
        start = static_cast<double>(at_zero - (kept ? 0 : 1));
        x = static_cast<double>(-dy * snaps);
        y = static_cast<double>(dx * snaps);
    }
    /// Narrows a row's part [first, last] to what is inside. All numbers are whole and below 2⁵³, and
    /// quotients within an image differ from whole ones by more than they are rounded by: nothing is missed.
    void narrow(int row, int& first, int& last) const {
        const double rest = start + y * row;
        if (x > 0) {
            const double least = std::ceil(-rest / x);
            if (least > first) first = least > last ? last + 1 : static_cast<int>(least);
        } else if (x < 0) {
            const double most = std::floor(rest / -x);
            if (most < last) last = most < first ? first - 1 : static_cast<int>(most);
        } else if (rest < 0) {
            last = first - 1;
        }
    }
};

class ByProcessor : public SignedDepths {
public:
    void add(const TriangleMesh& mesh, const Moves& moves) override {
        Mesh& made = meshes_.emplace_back();
        made.places = in_floats(mesh.vertices);
        made.triangles = mesh.triangles;
        for (std::size_t k = 0; k < moves.size(); ++k) made.moves[k].assign(moves[k].begin(), moves[k].end());
    }

    void move(int mesh, const TriangleMesh& moved) override {
        meshes_.at(static_cast<std::size_t>(mesh)).places = in_floats(moved.vertices);
    }

    std::span<const float> draw(std::span<const int> meshes, const CArm& arm, PathLengthRenderer::Phase phase,
                                const Window& window) override {
        window_ = window;
        sums_.assign(static_cast<std::size_t>(window.width()) * window.height() * 4, 0.0f);
        const Camera camera(arm);
        isocentre_ = arm.sod;
        per_slope_ = camera.per_slope;
        centre_ = camera.centre;
        for (const int mesh : meshes) draw(meshes_.at(static_cast<std::size_t>(mesh)), camera, phase);
        return sums_;
    }

private:
    struct Mesh {
        std::vector<Vector3f> places;
        std::array<std::vector<Vector3f>, 3> moves;
        std::vector<std::array<int, 3>> triangles;
    };

    static std::vector<Vector3f> in_floats(const std::vector<Vec3>& places) {
        std::vector<Vector3f> floats;
        floats.reserve(places.size());
        for (const Vec3& place : places) floats.push_back(place.cast<float>());
        return floats;
    }

    Snapped snapped(const Vec3& seen) const {
        Snapped result;
        if (!(seen.z() >= least_depth)) return result;
        const double scale = per_slope_ / seen.z(), x = scale * seen.x(), y = scale * seen.y();
        // A little beyond: what is cut off at the border is rounded.
        if (!(std::abs(x) <= farthest + 1 && std::abs(y) <= farthest + 1)) return result;
        result.x = static_cast<std::int32_t>(std::floor((x + centre_) * snaps + 0.5));
        result.y = static_cast<std::int32_t>(std::floor((y + centre_) * snaps + 0.5));
        result.there = true;
        return result;
    }

    void draw(const Mesh& mesh, const Camera& camera, PathLengthRenderer::Phase phase) {
        const std::array<double, 3> parts{phase.breath, phase.beat, phase.drift};
        seen_.resize(mesh.places.size());
        corners_.resize(mesh.places.size());
        for (std::size_t v = 0; v < mesh.places.size(); ++v) {
            Vec3 place = mesh.places[v].cast<double>();
            for (std::size_t k = 0; k < parts.size(); ++k)
                if (!mesh.moves[k].empty() && parts[k] != 0)
                    place += parts[k] * mesh.moves[k][v].cast<double>();
            seen_[v] = camera.seen(place);
            corners_[v] = snapped(seen_[v]);
        }
        for (const auto& triangle : mesh.triangles) {
            const auto [a, b, c] =
                std::array{static_cast<std::size_t>(triangle[0]), static_cast<std::size_t>(triangle[1]),
                           static_cast<std::size_t>(triangle[2])};
            const std::array<const Vec3*, 3> plane{&seen_[a], &seen_[b], &seen_[c]};
            if (corners_[a].there && corners_[b].there && corners_[c].there) {
                fill(corners_[a], corners_[b], corners_[c], plane);
            } else {
                cut(plane);
            }
        }
    }

    /// The plane of a triangle.
    struct Face {
        Vec3 normal;
        double offset, nearest, farthest_depth;

        Face(const Vec3& a, const Vec3& b, const Vec3& c)
            : normal((b - a).cross(c - a)),
              offset(normal.dot(a)),
              nearest(std::max(least_depth, std::min({a.z(), b.z(), c.z()}))),
              farthest_depth(std::max(nearest, std::max({a.z(), b.z(), c.z()}))) {}
    };

    /// Pixels whose centres are at these places or beyond them, to the right and to the left.
    static int from(std::int32_t place) { return (place + snaps / 2 - 1) >> 8; }
    static int until(std::int32_t place) { return (place - snaps / 2) >> 8; }

    /// Adds what is in the triangle of three snapped corners and on the plane of the other three.
    void fill(const Snapped& a, Snapped b, Snapped c, const std::array<const Vec3*, 3>& plane) {
        // Most triangles of a fine mesh hold no pixel's centre.
        const int left = std::max(window_.left, from(std::min({a.x, b.x, c.x}))),
                  right = std::min(window_.right - 1, until(std::max({a.x, b.x, c.x}))),
                  top = std::max(window_.top, from(std::min({a.y, b.y, c.y}))),
                  bottom = std::min(window_.bottom - 1, until(std::max({a.y, b.y, c.y})));
        if (left > right || top > bottom) return;
        const std::int64_t area = (std::int64_t{b.x} - a.x) * (std::int64_t{c.y} - a.y) -
                                  (std::int64_t{b.y} - a.y) * (std::int64_t{c.x} - a.x);
        if (area == 0) return;
        // Where the ray enters, corners go as the hands of a clock: the image is seen from behind.
        const float sign = area > 0 ? -1.0f : 1.0f;
        if (area < 0) std::swap(b, c);
        const Face face(*plane[0], *plane[1], *plane[2]);
        const Edge edges[3] = {Edge(a, b), Edge(b, c), Edge(c, a)};
        // The depth at a pixel's centre is offset / (along·i + rest).
        const double along = face.normal.x() / per_slope_,
                     in_middle = face.normal.z() + along * (0.5 - centre_);
        for (int j = top; j <= bottom; ++j) {
            int first = left, last = right;
            for (const Edge& edge : edges) edge.narrow(j, first, last);
            if (first > last) continue;
            const double rest = in_middle + face.normal.y() * ((j + 0.5 - centre_) / per_slope_);
            float* to = sums_.data() + 4 * (static_cast<std::size_t>(j - window_.top) * window_.width() +
                                            static_cast<std::size_t>(first - window_.left));
            for (int i = first; i <= last; ++i, to += 4) {
                // Of a face on edge the quotient may be anything, and no number.
                double depth = face.offset / (along * i + rest);
                depth = depth < face.farthest_depth ? depth : face.farthest_depth;
                depth = depth > face.nearest ? depth : face.nearest;
                const auto there = static_cast<float>(depth - isocentre_);
                to[0] += sign * there;
                to[1] += sign * std::min(there, 0.0f);
                to[2] += sign;
            }
        }
    }

    /// The part of a triangle in front of the source and near the image.
    void cut(const std::array<const Vec3*, 3>& corners) {
        const double widest = farthest / per_slope_;
        const auto inside = [widest](const Vec3& v, int plane) {
            switch (plane) {
                case 0:
                    return v.z() - least_depth;
                case 1:
                    return widest * v.z() - v.x();
                case 2:
                    return widest * v.z() + v.x();
                case 3:
                    return widest * v.z() - v.y();
                default:
                    return widest * v.z() + v.y();
            }
        };
        std::vector<Vec3> polygon{*corners[0], *corners[1], *corners[2]}, kept;
        for (int plane = 0; plane < 5 && !polygon.empty(); ++plane) {
            kept.clear();
            for (std::size_t k = 0; k < polygon.size(); ++k) {
                const Vec3 &one = polygon[k], &other = polygon[(k + 1) % polygon.size()];
                const double here = inside(one, plane), there = inside(other, plane);
                if (here >= 0) kept.push_back(one);
                // From the corner that stays, whichever triangle it is: both of an edge get the same.
                if (here >= 0 && there < 0) kept.push_back(one + here / (here - there) * (other - one));
                if (here < 0 && there >= 0) kept.push_back(other + there / (there - here) * (one - other));
            }
            polygon.swap(kept);
        }
        if (polygon.size() < 3) return;
        const auto place = [this](Vec3 v) {
            v.z() = std::max(v.z(), least_depth);
            return snapped(v);
        };
        const Snapped first = place(polygon[0]);
        for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
            const Snapped one = place(polygon[k]), other = place(polygon[k + 1]);
            if (first.there && one.there && other.there) fill(first, one, other, corners);
        }
    }

    std::vector<Mesh> meshes_;
    std::vector<Vec3> seen_;
    std::vector<Snapped> corners_;
    std::vector<float> sums_;
    Window window_{};
    double isocentre_ = 0, per_slope_ = 0, centre_ = 0;
};

}  // namespace

std::unique_ptr<SignedDepths> signed_depths_by_processor() {
    return std::make_unique<ByProcessor>();
}

}  // namespace render

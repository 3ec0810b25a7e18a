#include "render/xray/volume.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <thread>
#include <vector>

#include "physics/geometry/parallel.h"

namespace render {

using geometry::Mat3;

Mat3 VolumeGrid::axes() const {
    Mat3 columns;
    for (int a = 0; a < 3; ++a) columns.col(a) = steps[a];
    return columns;
}

std::vector<std::string> problems(const DensityVolume& volume) {
    std::vector<std::string> found;
    const VolumeGrid& grid = volume.grid;
    const std::string name = "the volume '" + volume.name + "' ";
    constexpr int most = 1 << 15;  // along an axis, so that no product of two overflows
    if (std::any_of(grid.size.begin(), grid.size.end(), [](int n) { return n < 1 || n > most; })) {
        found.push_back(name + "must have 1 to 32768 samples along each axis");
    } else if (grid.count() != volume.samples.size()) {
        found.push_back(name + "has " + std::to_string(volume.samples.size()) + " samples; its grid needs " +
                        std::to_string(grid.count()));
    }
    const Mat3 axes = grid.axes();
    if (!grid.origin.allFinite() || !axes.allFinite()) {
        found.push_back(name + "has a grid that is not finite");
    } else {
        const double box = axes.col(0).norm() * axes.col(1).norm() * axes.col(2).norm();
        if (!(std::abs(axes.determinant()) > 1e-3 * box) || !(box > 0))
            found.push_back(name + "has steps of length 0 or in one plane");
    }
    if (volume.parts.empty()) found.push_back(name + "has no materials");
    for (const VolumePart& part : volume.parts) {
        bool fine = !part.knots.empty();
        for (std::size_t i = 0; i < part.knots.size(); ++i) {
            fine = fine && std::isfinite(part.knots[i].sample) && std::isfinite(part.knots[i].fraction) &&
                   (i == 0 || part.knots[i].sample > part.knots[i - 1].sample);
        }
        if (!fine)
            found.push_back(name + "has no finite, ascending knots for " +
                            std::string(name_of(part.material)));
    }
    return found;
}

namespace {

/// Samples this far apart are some pixels of an image apart [mm].
constexpr double smooth_from = 1.2;

constexpr int lanes = 4;  // parts that are integrated at once
using Fractions = float __attribute__((vector_size(lanes * sizeof(float))));

double fraction_at(const VolumePart& part, double sample) {
    const auto& knots = part.knots;
    if (sample <= knots.front().sample) return knots.front().fraction;
    for (std::size_t i = 1; i < knots.size(); ++i) {
        if (sample > knots[i].sample) continue;
        const double t = (sample - knots[i - 1].sample) / (knots[i].sample - knots[i - 1].sample);
        return knots[i - 1].fraction + t * (knots[i].fraction - knots[i - 1].fraction);
    }
    return knots.back().fraction;
}

/// Indices of samples, the last exclusive.
struct IndexRange {
    int first = 0, end = 0;
};

/// A ray in the grid's indices, the layers of whose axis it crosses: at layer n it is at u0 + n·du of the
/// second axis and v0 + n·dv of the third.
struct LayerRay {
    int axis = 0;
    double u0 = 0, du = 0, v0 = 0, dv = 0;
    double length = 0;  // from a layer to the next [mm]
    IndexRange layers;  // between source and detector
};

LayerRay layer_ray(const Vec3& source, const Vec3& along, double distance) {
    LayerRay ray;
    along.cwiseAbs().maxCoeff(&ray.axis);
    const int b = (ray.axis + 1) % 3, c = (ray.axis + 2) % 3;
    const double per_layer = 1.0 / along[ray.axis];
    ray.du = along[b] * per_layer;
    ray.dv = along[c] * per_layer;
    ray.u0 = source[b] - source[ray.axis] * ray.du;
    ray.v0 = source[c] - source[ray.axis] * ray.dv;
    ray.length = distance * std::abs(per_layer);
    const double from = source[ray.axis], to = from + along[ray.axis];
    constexpr double far = 1 << 20;  // beyond any grid
    ray.layers.first = static_cast<int>(std::ceil(std::clamp(std::min(from, to), -far, far)));
    ray.layers.end = static_cast<int>(std::floor(std::clamp(std::max(from, to), -far, far))) + 1;
    return ray;
}

/// Narrows the layers to those where low < p0 + n·dp < high, up to a layer too many at either end.
void narrow(IndexRange& layers, double p0, double dp, double low, double high) {
    if (dp == 0.0) {
        if (!(p0 > low && p0 < high)) layers.end = layers.first;
        return;
    }
    double from = (low - p0) / dp, to = (high - p0) / dp;
    if (from > to) std::swap(from, to);
    const double first = layers.first, end = layers.end;
    layers.first = static_cast<int>(std::clamp(std::floor(from), first, end));
    layers.end = static_cast<int>(std::clamp(std::ceil(to) + 1.0, static_cast<double>(layers.first), end));
}

}  // namespace

struct VolumeRayCaster::State {
    DensityVolume volume;
    int threads = 1;
    Mat3 to_index = Mat3::Identity();
    int lowest = 0;                              // of the samples
    std::vector<std::vector<Fractions>> tables;  // of each four parts, by sample − lowest
    std::array<IndexRange, 3> occupied;          // the box around all samples with any fraction
    std::array<std::ptrdiff_t, 3> strides{};

    void find_occupied();
    std::array<bool, 3> smooth{};  // between samples along an axis: see DensityVolume

    Fractions integral(const std::vector<Fractions>&, const LayerRay&) const;
    template <bool SmoothU, bool SmoothV>
    Fractions integral_by(const std::vector<Fractions>&, const LayerRay&) const;
    template <bool SmoothU, bool SmoothV>
    Fractions near_edge(const std::vector<Fractions>&, const LayerRay&, IndexRange) const;
    std::vector<Field> cast(const CArm&) const;
};

VolumeRayCaster::VolumeRayCaster(DensityVolume volume, int threads) {
    std::string wrong;
    for (const std::string& sentence : problems(volume)) wrong += (wrong.empty() ? "" : "; ") + sentence;
    if (!wrong.empty()) throw std::invalid_argument(wrong);
    auto state = std::make_shared<State>();
    state->volume = std::move(volume);
    const unsigned processors = std::clamp(std::thread::hardware_concurrency(), 1u, 64u);
    state->threads = threads > 0 ? threads : static_cast<int>(processors);
    const DensityVolume& own = state->volume;
    state->to_index = own.grid.axes().inverse();
    state->strides = {1, own.grid.size[0], static_cast<std::ptrdiff_t>(own.grid.size[0]) * own.grid.size[1]};
    const auto [low, high] = std::minmax_element(own.samples.begin(), own.samples.end());
    state->lowest = *low;
    for (std::size_t first = 0; first < own.parts.size(); first += lanes) {
        std::vector<Fractions>& table =
            state->tables.emplace_back(static_cast<std::size_t>(*high - *low) + 1);
        for (std::size_t s = 0; s < table.size(); ++s) {
            table[s] = Fractions{};
            for (std::size_t p = first; p < std::min(own.parts.size(), first + lanes); ++p)
                table[s][p - first] =
                    static_cast<float>(fraction_at(own.parts[p], static_cast<double>(s) + *low));
        }
    }
    for (int axis = 0; axis < 3; ++axis)
        state->smooth[static_cast<std::size_t>(axis)] = own.grid.steps[axis].norm() >= smooth_from;
    state->find_occupied();
    state_ = std::move(state);
}

const std::vector<VolumePart>& VolumeRayCaster::parts() const {
    return state_->volume.parts;
}

void VolumeRayCaster::State::find_occupied() {
    std::vector<char> counts(tables.front().size(), 0);
    for (const std::vector<Fractions>& table : tables)
        for (std::size_t s = 0; s < table.size(); ++s)
            for (int lane = 0; lane < lanes; ++lane) counts[s] |= table[s][lane] != 0.0f;
    const VolumeGrid& grid = volume.grid;
    struct Box {
        IndexRange i{std::numeric_limits<int>::max(), 0}, j{std::numeric_limits<int>::max(), 0};
    };
    std::vector<Box> boxes(static_cast<std::size_t>(grid.size[2]));  // of each k
    geometry::parallel_for(
        grid.size[2], threads,
        [&](int k) {
            Box& box = boxes[static_cast<std::size_t>(k)];
            for (int j = 0; j < grid.size[1]; ++j) {
                const std::int16_t* row = volume.samples.data() + grid.index(0, j, k);
                const auto counting = [&](std::int16_t s) { return counts[s - lowest] != 0; };
                const std::int16_t* end = row + grid.size[0];
                const std::int16_t* first = std::find_if(row, end, counting);
                if (first == end) continue;
                const std::int16_t* last = end - 1;
                while (!counting(*last)) --last;
                box.i = {std::min(box.i.first, static_cast<int>(first - row)),
                         std::max(box.i.end, static_cast<int>(last - row) + 1)};
                box.j = {std::min(box.j.first, j), j + 1};
            }
        },
        {}, 4);
    occupied = {IndexRange{grid.size[0], 0}, IndexRange{grid.size[1], 0}, IndexRange{grid.size[2], 0}};
    for (int k = 0; k < grid.size[2]; ++k) {
        const Box& box = boxes[static_cast<std::size_t>(k)];
        if (box.j.end == 0) continue;
        occupied[0] = {std::min(occupied[0].first, box.i.first), std::max(occupied[0].end, box.i.end)};
        occupied[1] = {std::min(occupied[1].first, box.j.first), std::max(occupied[1].end, box.j.end)};
        occupied[2] = {std::min(occupied[2].first, k), k + 1};
    }
}

namespace {

/// The samples that count at a place between them, from the first on, and their weights: two linear ones, or
/// the three of a quadratic B-spline.
template <bool Smooth>
struct Taps {
    static constexpr int count = Smooth ? 3 : 2;
    /// The first and last places at which none of them lies outside samples 0 to n − 1 are `inset` and
    /// n − 1 − inset.
    static constexpr double inset = Smooth ? 0.5 : 0.0;
    static constexpr double reach = Smooth ? 1.5 : 1.0;  // farther samples do not count

    int first;
    std::array<float, count> weights;

    explicit Taps(double place) {
        if constexpr (Smooth) {
            const int middle = static_cast<int>(std::floor(place + 0.5));
            const auto t = static_cast<float>(place - middle);  // −0.5 to 0.5
            first = middle - 1;
            weights = {0.5f * (0.5f - t) * (0.5f - t), 0.75f - t * t, 0.5f * (0.5f + t) * (0.5f + t)};
        } else {
            first = static_cast<int>(std::floor(place));
            const auto t = static_cast<float>(place - first);
            weights = {1.0f - t, t};
        }
    }
};

}  // namespace

/// The layers at which some of the samples lie outside the box; those count as 0.
template <bool SmoothU, bool SmoothV>
Fractions VolumeRayCaster::State::near_edge(const std::vector<Fractions>& table, const LayerRay& ray,
                                            IndexRange layers) const {
    const int b = (ray.axis + 1) % 3, c = (ray.axis + 2) % 3;
    const IndexRange across = occupied[b], along = occupied[c];
    Fractions sum{};
    for (int n = layers.first; n < layers.end; ++n) {
        const Taps<SmoothU> u(ray.u0 + n * ray.du);
        const Taps<SmoothV> v(ray.v0 + n * ray.dv);
        for (int j = 0; j < v.count; ++j)
            for (int i = 0; i < u.count; ++i) {
                const int x = u.first + i, y = v.first + j;
                if (x < across.first || x >= across.end || y < along.first || y >= along.end) continue;
                const std::int16_t sample = volume.samples[static_cast<std::size_t>(
                    n * strides[ray.axis] + x * strides[b] + y * strides[c])];
                sum += u.weights[i] * v.weights[j] * table[static_cast<std::size_t>(sample - lowest)];
            }
    }
    return sum;
}

template <bool SmoothU, bool SmoothV>
Fractions VolumeRayCaster::State::integral_by(const std::vector<Fractions>& table,
                                              const LayerRay& ray) const {
    const int b = (ray.axis + 1) % 3, c = (ray.axis + 2) % 3;
    const IndexRange across = occupied[b], along = occupied[c];
    using U = Taps<SmoothU>;
    using V = Taps<SmoothV>;
    IndexRange all = {std::max(ray.layers.first, occupied[ray.axis].first),
                      std::min(ray.layers.end, occupied[ray.axis].end)};
    if (all.first >= all.end) return Fractions{};
    narrow(all, ray.u0, ray.du, across.first - U::reach, across.end - 1 + U::reach);
    narrow(all, ray.v0, ray.dv, along.first - V::reach, along.end - 1 + V::reach);
    // The layers at which all samples lie in the box.
    IndexRange within = all;
    narrow(within, ray.u0, ray.du, across.first + U::inset, across.end - 1 - U::inset);
    narrow(within, ray.v0, ray.dv, along.first + V::inset, along.end - 1 - V::inset);
    const auto inside = [&](int n) {
        const double u = ray.u0 + n * ray.du, v = ray.v0 + n * ray.dv;
        return u >= across.first + U::inset && u < across.end - 1 - U::inset && v >= along.first + V::inset &&
               v < along.end - 1 - V::inset;
    };
    while (within.first < within.end && !inside(within.first)) ++within.first;
    while (within.first < within.end && !inside(within.end - 1)) --within.end;
    if (within.first >= within.end) within = {all.end, all.end};

    Fractions sum = near_edge<SmoothU, SmoothV>(table, ray, {all.first, within.first});
    const std::ptrdiff_t sb = strides[b], sc = strides[c], sa = strides[ray.axis];
    const std::int16_t* layer = volume.samples.data() + within.first * sa;
    const Fractions* fractions = table.data() - lowest;
    for (int n = within.first; n < within.end; ++n, layer += sa) {
        const double u = ray.u0 + n * ray.du, v = ray.v0 + n * ray.dv;
        if constexpr (SmoothU || SmoothV) {
            const U across_taps(u);
            const V along_taps(v);
            const std::int16_t* row = layer + across_taps.first * sb + along_taps.first * sc;
            for (int j = 0; j < V::count; ++j, row += sc) {
                Fractions of_row{};
                for (int i = 0; i < U::count; ++i) of_row += across_taps.weights[i] * fractions[row[i * sb]];
                sum += along_taps.weights[j] * of_row;
            }
        } else {
            const int iu = static_cast<int>(u), iv = static_cast<int>(v);
            const auto fu = static_cast<float>(u - iu), fv = static_cast<float>(v - iv);
            const std::int16_t* at = layer + iu * sb + iv * sc;
            const float both = fu * fv, only_u = fu - both, only_v = fv - both;
            sum += (1.0f - fu - only_v) * fractions[at[0]] + only_u * fractions[at[sb]] +
                   only_v * fractions[at[sc]] + both * fractions[at[sb + sc]];
        }
    }
    return sum + near_edge<SmoothU, SmoothV>(table, ray, {std::max(within.end, within.first), all.end});
}

Fractions VolumeRayCaster::State::integral(const std::vector<Fractions>& table, const LayerRay& ray) const {
    const bool u = smooth[static_cast<std::size_t>(ray.axis + 1) % 3],
               v = smooth[static_cast<std::size_t>(ray.axis + 2) % 3];
    return u   ? v ? integral_by<true, true>(table, ray) : integral_by<true, false>(table, ray)
             : v ? integral_by<false, true>(table, ray)
               : integral_by<false, false>(table, ray);
}

std::vector<Field> VolumeRayCaster::State::cast(const CArm& arm) const {
    const int pixels = arm.pixels;
    std::vector<Field> lengths(volume.parts.size(), Field(pixels, pixels));
    if (occupied[0].first >= occupied[0].end) return lengths;
    const ArmAxes axes = render::axes(arm);
    const Vec3 from = source(arm);
    const Vec3 start = to_index * (from - volume.grid.origin);
    const double step = pixel_width(arm);
    geometry::parallel_for(
        pixels, threads,
        [&](int j) {
            for (int i = 0; i < pixels; ++i) {
                const Vec3 ray_vector = arm.sid * axes.beam + (i + 0.5 - 0.5 * pixels) * step * axes.right -
                                        (j + 0.5 - 0.5 * pixels) * step * axes.up;
                const LayerRay ray = layer_ray(start, to_index * ray_vector, ray_vector.norm());
                const std::size_t pixel = static_cast<std::size_t>(j) * pixels + i;
                for (std::size_t t = 0; t < tables.size(); ++t) {
                    const Fractions sum = integral(tables[t], ray) * static_cast<float>(ray.length);
                    for (std::size_t p = t * lanes; p < std::min(lengths.size(), (t + 1) * lanes); ++p)
                        lengths[p].values[pixel] = sum[p - t * lanes];
                }
            }
        },
        {}, 4);
    return lengths;
}

std::vector<Field> VolumeRayCaster::every_length(const CArm& arm) const {
    return state_->cast(arm);
}

std::vector<Field> VolumeRayCaster::lengths(const CArm& arm) const {
    const VolumeGrid& grid = state_->volume.grid;
    constexpr int margin = 2;  // rays beyond the image on either side
    double finest = std::numeric_limits<double>::infinity(), farthest = 0.0;
    for (const Vec3& step : grid.steps) finest = std::min(finest, step.norm());
    for (int corner = 0; corner < 8; ++corner) {
        const Vec3 at = grid.at(corner & 1 ? grid.size[0] - 1 : 0, corner & 2 ? grid.size[1] - 1 : 0,
                                corner & 4 ? grid.size[2] - 1 : 0);
        farthest = std::max(farthest, project(arm, at).depth);
    }
    farthest = std::min(farthest, arm.sid);
    const double needed = arm.detector_width * farthest / (arm.sid * finest);
    if (!(needed + 2 * margin < arm.pixels)) return state_->cast(arm);
    const int inner = std::max(1, static_cast<int>(std::ceil(needed)));
    CArm coarse = arm;
    coarse.pixels = inner + 2 * margin;
    coarse.detector_width = arm.detector_width * coarse.pixels / inner;
    std::vector<Field> lengths = state_->cast(coarse);
    for (Field& length : lengths) length = spline_enlarged(std::move(length), margin, arm.pixels);
    return lengths;
}

namespace {

/// Coefficients of the cubic B-spline through values that are `stride` apart, mirrored at both ends. M.
/// Unser, IEEE Signal Processing Magazine 16(6):22–38 (1999), box 2: a recursion forth and back with the pole
/// √3 − 2.
void to_coefficients(float* values, int count, int stride) {
    if (count < 2) return;
    const auto at = [=](int i) -> float& { return values[static_cast<std::ptrdiff_t>(i) * stride]; };
    const float pole = std::sqrt(3.0f) - 2.0f;
    constexpr int horizon = 12;  // pole^12 < 2e-7
    float sum = at(0), power = pole;
    for (int i = 1; i < std::min(horizon, count); ++i, power *= pole) sum += power * at(i);
    at(0) = sum;
    for (int i = 1; i < count; ++i) at(i) += pole * at(i - 1);
    at(count - 1) = pole / (pole * pole - 1.0f) * (at(count - 1) + pole * at(count - 2));
    for (int i = count - 2; i >= 0; --i) at(i) = pole * (at(i + 1) - at(i));
    for (int i = 0; i < count; ++i) at(i) *= 6.0f;
}

/// The four coefficients that a place takes, and their weights.
struct SplinePlace {
    std::array<int, 4> nodes;
    std::array<float, 4> weights;
};

SplinePlace spline_place(double x, int count) {
    const int low = static_cast<int>(std::floor(x));
    const auto t = static_cast<float>(x - low), s = 1.0f - t;
    SplinePlace place{{},
                      {s * s * s / 6.0f, 2.0f / 3.0f - t * t * (2.0f - t) / 2.0f,
                       2.0f / 3.0f - s * s * (2.0f - s) / 2.0f, t * t * t / 6.0f}};
    for (int k = 0; k < 4; ++k) {
        int node = std::abs(low - 1 + k);
        if (node >= count) node = 2 * (count - 1) - node;
        place.nodes[k] = std::clamp(node, 0, count - 1);
    }
    return place;
}

}  // namespace

Field spline_enlarged(Field field, int margin, int pixels) {
    assert(field.width == field.height && field.width > 2 * margin);
    const int count = field.width, inner = count - 2 * margin;
    for (int j = 0; j < count; ++j)
        to_coefficients(&field.values[static_cast<std::size_t>(j) * count], count, 1);
    for (int i = 0; i < count; ++i) to_coefficients(&field.values[static_cast<std::size_t>(i)], count, count);

    std::vector<SplinePlace> places;
    for (int i = 0; i < pixels; ++i)
        places.push_back(spline_place((i + 0.5) * inner / pixels - 0.5 + margin, count));
    Field enlarged(pixels, pixels);
    std::vector<float> row(static_cast<std::size_t>(count));
    for (int j = 0; j < pixels; ++j) {
        const SplinePlace& down = places[static_cast<std::size_t>(j)];
        std::array<const float*, 4> from;
        for (int k = 0; k < 4; ++k) from[k] = &field.values[static_cast<std::size_t>(down.nodes[k]) * count];
        for (int i = 0; i < count; ++i)
            row[static_cast<std::size_t>(i)] = down.weights[0] * from[0][i] + down.weights[1] * from[1][i] +
                                               down.weights[2] * from[2][i] + down.weights[3] * from[3][i];
        float* to = &enlarged.values[static_cast<std::size_t>(j) * pixels];
        for (int i = 0; i < pixels; ++i) {
            const SplinePlace& across = places[static_cast<std::size_t>(i)];
            to[i] = across.weights[0] * row[across.nodes[0]] + across.weights[1] * row[across.nodes[1]] +
                    across.weights[2] * row[across.nodes[2]] + across.weights[3] * row[across.nodes[3]];
        }
    }
    return enlarged;
}

}  // namespace render

#include "physics/wall/field_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>

#include "physics/geometry/parallel.h"
#include "physics/wall/even_rims.h"
#include "physics/wall/station_runs.h"

namespace physics {
namespace {

/// A sheet's field reaches this many radii from its centreline: lumens are not round.
constexpr double roundness = 1.5;
/// Spacings that the grids reach past an open end.
constexpr double past_ends = 4;
/// Where neighbouring triangles turn by more than 30°, the wall has a crease.
constexpr double crease = 0.87;
/// Bricks along the edge of the cubes that the search for the wall starts from, a power of two.
constexpr int cube_bricks = 4;

std::vector<int> all_of(std::span<const Station> stations) {
    std::vector<int> all(stations.size());
    std::iota(all.begin(), all.end(), 0);
    return all;
}

/// For each triangle the station whose vessel wall it belongs to: of the stations that it faces away from,
/// the one whose ball is nearest. The facing separates the walls of two vessels that nearly touch.
std::vector<int> stations_of(const LumenSurface& surface, const CentrelineTree& tree, int threads) {
    const StationRuns runs(tree.stations(), all_of(tree.stations()));
    std::vector<int> found(surface.count());
    constexpr std::size_t piece_size = 256;  // triangles, of which each is a seed for the next
    parallel_for((found.size() + piece_size - 1) / piece_size, threads, [&](std::size_t piece) {
        int seed = -1;
        for (std::size_t t = piece * piece_size; t < std::min(found.size(), (piece + 1) * piece_size); ++t) {
            const Vec3 x = surface.centroid(t), normal = surface.area_normal(t);
            const auto faced_away = [&](int s) { return normal.dot(x - tree.stations()[s].centre) > 0; };
            const int best = runs.deepest(x, seed >= 0 && faced_away(seed) ? seed : -1, faced_away);
            if (best >= 0) seed = best;
            found[t] = best >= 0 ? best : runs.deepest(x, -1);
        }
    });
    return found;
}

/// The distance to the wall that a place on a sheet sees.
class View {
public:
    View(const LumenSurface& surface, const CentrelineTree& tree, const VesselSheets& sheets,
         const std::vector<StationRuns>& runs, const std::vector<int>& station_of_triangle,
         const SeenSurface& triangles, double margin)
        : surface_(surface),
          tree_(tree),
          sheets_(sheets),
          runs_(runs),
          station_of_triangle_(station_of_triangle),
          triangles_(triangles),
          margin_(margin),
          seen_(tree.stations().size(), 0) {}

    /// Looks from the station of a sheet that holds x deepest.
    void look_from(int sheet, const Vec3& x) {
        const bool same = station_ >= 0 && sheets_.map.sheet_of[station_] == sheet;
        const int best = runs_[sheet].deepest(x, same ? station_ : -1);
        if (best == station_) return;
        if (station_ >= 0)
            for (int s : sheets_.seen[station_]) seen_[s] = 0;
        for (int s : sheets_.seen[best]) seen_[s] = 1;
        station_ = best;
    }

    double beyond_an_end(const Vec3& x) const {
        double out = 0;
        for (int e : sheets_.ends[station_]) out = std::max(out, tree_.ends()[e].beyond(x, margin_));
        return out;
    }

    /// The triangle of the last distance, -1 = none.
    int triangle() const { return found_; }

    /// Signed distance, negative inside. Beyond an open end the wall goes on straight.
    double distance(const Vec3& x) {
        const Vec3 y = seen_at(x);
        return signed_distance(y, triangles_.nearest(y, seed_, {seen_, station_of_triangle_}));
    }

    /// Calls visit(k, distance) for each of these places until it returns false. The places are near one
    /// another, and each eight of them even more so.
    template <class Visit>
    void distances(std::span<const Vec3> places, const Visit& visit) {
        moved_.clear();
        for (const Vec3& x : places) moved_.push_back(seen_at(x));
        const auto [middle, reach] = ball_around(moved_);
        all_.gather(triangles_, middle, reach, seed_, {seen_, station_of_triangle_});
        const bool all_outside = !well_inside(middle, reach);
        for (std::size_t first = 0; first < moved_.size(); first += 8) {
            const std::span eight = std::span<const Vec3>(moved_).subspan(first, 8);
            const auto [centre, radius] = ball_around(eight);
            if (!all_.empty()) few_.gather(all_, centre, radius);
            for (const Vec3& y : eight) {
                const NearestTriangle nearest = all_.empty() ? NearestTriangle{} : few_.nearest(y);
                if (!visit(&y - moved_.data(), signed_distance(y, nearest, all_outside))) return;
            }
        }
    }

private:
    static std::pair<Vec3, double> ball_around(std::span<const Vec3> places) {
        Eigen::AlignedBox3d box;
        for (const Vec3& x : places) box.extend(x);
        double square = 0;
        for (const Vec3& x : places) square = std::max(square, (x - box.center()).squaredNorm());
        return {box.center(), std::sqrt(square)};
    }
    Vec3 seen_at(Vec3 x) const {
        for (int e : sheets_.ends[station_]) {
            const OpenEnd& end = tree_.ends()[e];
            x -= end.beyond(x, margin_) * end.outward_normal;
        }
        return x;
    }
    /// `not_well_inside`: known not to be.
    double signed_distance(const Vec3& x, const NearestTriangle& nearest, bool not_well_inside = false) {
        found_ = nearest.triangle;
        if (found_ < 0) return to_balls(x);
        seed_ = found_;
        const double d = std::sqrt(nearest.at.square_distance);
        const Vec3 normal = surface_.pseudo_normal(nearest.triangle, nearest.at.feature);
        if (normal.dot(x - nearest.at.point) < 0) return -d;
        // What lies well within an inscribed ball is inside, whatever a damaged mesh says.
        const bool doubtful = d > 0.3 * tree_.stations()[station_].radius;
        return doubtful && !not_well_inside && well_inside(x, 0) ? -d : d;
    }
    double to_balls(const Vec3& x) const {
        double least = std::numeric_limits<double>::max();
        for (int s : sheets_.seen[station_]) {
            const Station& station = tree_.stations()[s];
            least = std::min(least, (x - station.centre).norm() - station.radius);
        }
        return least;
    }
    /// Whether any place within `reach` of x is well within a ball.
    bool well_inside(const Vec3& x, double reach) const {
        return std::any_of(sheets_.seen[station_].begin(), sheets_.seen[station_].end(), [&](int s) {
            const Station& station = tree_.stations()[s];
            const double square = (x - station.centre).squaredNorm();
            if (reach == 0) return square < 0.5 * station.radius * station.radius;
            const double most = std::sqrt(0.5) * station.radius + reach + 1e-9;
            return square < most * most;
        });
    }

    const LumenSurface& surface_;
    const CentrelineTree& tree_;
    const VesselSheets& sheets_;
    const std::vector<StationRuns>& runs_;  // per sheet
    const std::vector<int>& station_of_triangle_;
    const SeenSurface& triangles_;
    double margin_;  // [mm]
    SeenSurface::Patch all_, few_;
    std::vector<Vec3> moved_;
    std::vector<char> seen_;
    int station_ = -1, seed_ = -1, found_ = -1;
};

struct Cube {
    int sheet;
    SplineGrid::Brick first;  // brick
    int side;                 // [bricks]
};

/// Cubes that cover the reach of every sheet, in a fixed order.
std::vector<Cube> cubes(const CentrelineTree& tree, const VesselSheets& sheets, const FieldBand& band,
                        double spacing) {
    std::vector<Cube> all;
    const double edge = cube_bricks * SplineGrid::brick_side * spacing;
    for (std::size_t sheet = 0; sheet < sheets.stations.size(); ++sheet) {
        std::set<SplineGrid::Brick> mine;
        for (int s : sheets.stations[sheet]) {
            const Station& station = tree.stations()[s];
            const double reach = roundness * station.radius + band.outer + edge / 2;
            int low[3], high[3];
            for (int d = 0; d < 3; ++d) {
                low[d] = static_cast<int>(std::floor((station.centre[d] - reach) / edge));
                high[d] = static_cast<int>(std::floor((station.centre[d] + reach) / edge));
            }
            for (int i = low[0]; i <= high[0]; ++i)
                for (int j = low[1]; j <= high[1]; ++j)
                    for (int k = low[2]; k <= high[2]; ++k) {
                        const Vec3 offset = edge * Vec3(i + 0.5, j + 0.5, k + 0.5) - station.centre;
                        if (offset.norm() < reach + edge)
                            mine.insert({cube_bricks * i, cube_bricks * j, cube_bricks * k});
                    }
        }
        for (const auto& first : mine) all.push_back({static_cast<int>(sheet), first, cube_bricks});
    }
    return all;
}

/// The search for the bricks that serve a cell within the band.
struct BrickSearch {
    const std::vector<StationRuns>& runs;  // per sheet
    const FieldBand& band;
    double spacing;  // [mm]
    View& view;

    /// Whether the band may reach into a cube of space.
    bool meets(int sheet, const Vec3& centre, double side) const {
        const double reach = side / 2 * std::numbers::sqrt3;
        if (!runs[sheet].near(centre, roundness, band.outer + reach)) return false;
        view.look_from(sheet, centre);
        if (view.beyond_an_end(centre) > reach + past_ends * spacing) return false;
        const double d = view.distance(centre);
        return d <= band.outer + reach && d >= -band.inner - reach;
    }

    void serve(const Cube& cube, std::vector<SplineGrid::Brick>& bricks) const {
        // The cells that a brick serves begin one node after its first.
        const double h = spacing, side = cube.side * SplineGrid::brick_side * h;
        Vec3 low;
        for (int d = 0; d < 3; ++d) low[d] = (SplineGrid::brick_side * cube.first[d] + 1) * h;
        if (!meets(cube.sheet, low + Vec3::Constant(side / 2), side)) return;
        const int half = cube.side / 2;
        for (int n = 0; n < 8; ++n) {
            const int i = n >> 2, j = n >> 1 & 1, k = n & 1;
            if (half > 0) {
                const auto& f = cube.first;
                serve({cube.sheet, {f[0] + half * i, f[1] + half * j, f[2] + half * k}, half}, bricks);
            } else if (meets(cube.sheet, low + side / 4 * Vec3(2 * i + 1, 2 * j + 1, 2 * k + 1), side / 2)) {
                bricks.push_back(cube.first);
                return;
            }
        }
    }
};

/// Least number of bricks that the band fills.
double band_bricks(const CentrelineTree& tree, const FieldBand& band) {
    const auto stations = tree.stations();
    double bricks = 0;
    for (std::size_t s = 1; s < stations.size(); ++s) {
        if (stations[s].branch != stations[s - 1].branch) continue;
        const double edge =
            SplineGrid::brick_side * band.spacing * (1 << level_of(stations[s].radius, band.wide));
        bricks += band_section(stations[s].radius, band.inner, band.outer) *
                  (stations[s].centre - stations[s - 1].centre).norm() / (edge * edge * edge);
    }
    return bricks;
}

/// Rejects a field whose bricks would take more memory than allowed, during or after building.
void check_size(double bricks, const FieldBand& band) {
    constexpr double bytes = 2 * 4 * SplineGrid::node_count + 80;  // of a brick while coefficients are fitted
    if (bricks * bytes <= static_cast<double>(band.largest)) return;
    refuse_size(band.spacing, bricks * bytes, band.largest);
}

using BrickList = std::vector<SplineGrid::Brick>;

/// Sorts the bricks and keeps each once.
void tidy(BrickList& bricks) {
    std::sort(bricks.begin(), bricks.end());
    bricks.erase(std::unique(bricks.begin(), bricks.end()), bricks.end());
}

/// The bricks and those around them, each once, in order.
BrickList with_neighbours(const BrickList& bricks) {
    BrickList all;
    for (const auto& b : bricks)
        for (int n = 0; n < 27; ++n)
            all.push_back({b[0] + n / 9 - 1, b[1] + n / 3 % 3 - 1, b[2] + n % 3 - 1});
    tidy(all);
    return all;
}

class Sampler {
public:
    Sampler(const LumenSurface& surface, const CentrelineTree& tree, const VesselSheets& sheets,
            const FieldBand& band, const std::function<void(double)>& progress)
        : surface_(surface),
          tree_(tree),
          sheets_(sheets),
          band_(band),
          triangles_(surface),
          progress_(progress),
          station_of_triangle_(stations_of(surface, tree, band.threads)),
          level_(surface.count(), 0) {
        const auto stations = tree.stations();
        for (const auto& sheet : sheets.stations) runs_.emplace_back(stations, sheet);
        for (int t = 0; t < surface.count(); ++t)
            if (surface.flatness(t) >= crease)
                level_[t] = static_cast<char>(level_of(stations[station_of_triangle_[t]].radius, band.wide));
    }

    /// Grids of values, not fitted.
    std::vector<SheetField> values() {
        const double h = band_.spacing;
        const int top = *std::max_element(level_.begin(), level_.end());
        std::vector<SheetField> fields(sheets_.stations.size());
        std::vector<std::vector<SplineGrid>> levels;
        for (int level = 0; level < SheetField::level_count; ++level)
            levels.push_back(grids(h * (1 << level), std::vector<BrickList>(fields.size())));
        std::vector<Cube> starts = cubes(tree_, sheets_, band_, h * (1 << top));
        std::vector<BrickList> close;  // per sheet, of the level above: where this one is asked for
        for (int level = top; level >= 0; --level) {
            const double part = 0.9 / (top + 1), from = 0.05 + (top - level) * part,
                         sampled = from + part / 8;
            std::vector<BrickList> bricks = served(starts, h * (1 << level), from, sampled);
            for (std::size_t g = 0; g < close.size(); ++g)
                std::erase_if(bricks[g],
                              [&](const SplineGrid::Brick& b) { return !holds(close[g], half(b)); });
            std::vector<SplineGrid>& here = levels[level];
            here = grids(h * (1 << level), std::move(bricks));
            if (level == 0) {
                sample(here, sampled, from + part);
                break;
            }
            const auto least = sample_down_to(level, here, sampled, from + part);
            std::vector<BrickList> closer;
            starts.clear();
            for (std::size_t g = 0; g < here.size(); ++g) {
                const auto split = to_split(level, here[g], least[g], close.empty() ? nullptr : &close[g]);
                closer.push_back(with_neighbours(split_off(split, here[g])));
                for (const auto& b : closer[g])
                    starts.push_back({static_cast<int>(g), {2 * b[0], 2 * b[1], 2 * b[2]}, 2});
            }
            close = std::move(closer);
        }
        for (std::size_t g = 0; g < fields.size(); ++g)
            for (auto& grids_of_level : levels) fields[g].grids.push_back(std::move(grids_of_level[g]));
        if (progress_) progress_(1.0);
        return fields;
    }

private:
    View view() const {
        return View(surface_, tree_, sheets_, runs_, station_of_triangle_, triangles_, band_.outer);
    }
    std::function<void(double)> part(double from, double to) const {
        return [this, from, to](double fraction) {
            if (progress_) progress_(from + (to - from) * fraction);
        };
    }

    /// The bricks of each sheet that a grid needs within these cubes.
    std::vector<BrickList> served(const std::vector<Cube>& starts, double spacing, double from,
                                  double to) const {
        std::vector<BrickList> found(starts.size()), bricks(sheets_.stations.size());
        parallel_for(
            starts.size(), band_.threads,
            [&](std::size_t c) {
                View here = view();
                BrickSearch{runs_, band_, spacing, here}.serve(starts[c], found[c]);
            },
            part(from, to));
        double total = 0;
        for (std::size_t c = 0; c < starts.size(); ++c)
            for (const auto& b : found[c])
                for (int n = 0; n < 8; ++n)
                    bricks[starts[c].sheet].push_back({b[0] + (n >> 2), b[1] + (n >> 1 & 1), b[2] + (n & 1)});
        for (auto& b : bricks) {
            tidy(b);
            total += static_cast<double>(b.size());
        }
        check_size(total, band_);
        return bricks;
    }
    static std::vector<SplineGrid> grids(double spacing, std::vector<BrickList> bricks) {
        std::vector<SplineGrid> all;
        for (auto& b : bricks) all.emplace_back(spacing, std::move(b));
        return all;
    }

    /// Nodes of a brick in an order in which each eight are the corners of a cell.
    static std::array<int, 3> by_cubes(int k) {
        static_assert(SplineGrid::brick_side == 4);
        return {(k >> 4 & 2) | (k >> 2 & 1), (k >> 3 & 2) | (k >> 1 & 1), (k >> 2 & 2) | (k & 1)};
    }

    /// Writes the distances at all nodes.
    void sample(std::vector<SplineGrid>& grids, double from, double to) const {
        sample(grids, from, to, [](const View&, int, std::size_t) { return true; });
    }
    /// Writes them and returns, per grid, the least level that a wall nearest to a node of each brick asks
    /// for. A brick that asks for the finest level is not needed here and is left unfinished.
    std::vector<std::vector<char>> sample_down_to(int level, std::vector<SplineGrid>& grids, double from,
                                                  double to) const {
        std::vector<std::vector<char>> least;
        for (const SplineGrid& grid : grids) least.emplace_back(grid.bricks(), static_cast<char>(level));
        sample(grids, from, to, [&](const View& at, int g, std::size_t b) {
            if (at.triangle() >= 0) least[g][b] = std::min(least[g][b], level_[at.triangle()]);
            return least[g][b] > 0;
        });
        return least;
    }
    /// The bricks that a finer grid replaces: those whose walls ask for it and, for the level after next,
    /// those around them too. None is replaced at the edge of where this level is asked for: the next level
    /// lies within it.
    static std::vector<char> to_split(int level, const SplineGrid& grid, const std::vector<char>& least,
                                      const BrickList* close) {
        BrickList wanted;
        for (std::size_t b = 0; b < grid.bricks(); ++b)
            if (least[b] < level - 1) wanted.push_back(grid.brick(b));
        wanted = with_neighbours(wanted);
        std::vector<char> split(grid.bricks(), 0);
        for (std::size_t b = 0; b < grid.bricks(); ++b) {
            if (least[b] >= level && !holds(wanted, grid.brick(b))) continue;
            const BrickList around = with_neighbours({grid.brick(b)});
            split[b] = !close || std::ranges::all_of(around, [&](const SplineGrid::Brick& beside) {
                return holds(*close, half(beside));
            });
        }
        return split;
    }
    static SplineGrid::Brick half(const SplineGrid::Brick& b) { return {b[0] >> 1, b[1] >> 1, b[2] >> 1}; }
    static bool holds(const BrickList& bricks, const SplineGrid::Brick& b) {
        return std::binary_search(bricks.begin(), bricks.end(), b);
    }
    /// Writes distances to the nodes of each brick until `goes_on`, called for the middle and after each
    /// node, returns false.
    template <class GoesOn>
    void sample(std::vector<SplineGrid>& grids, double from, double to, const GoesOn& goes_on) const {
        std::vector<std::pair<int, std::size_t>> work;  // grid, brick
        for (std::size_t g = 0; g < grids.size(); ++g) {
            for (std::size_t b = 0; b < grids[g].bricks(); ++b) work.push_back({static_cast<int>(g), b});
        }
        constexpr std::size_t piece_size = 4;  // bricks, of which each is a seed for the next
        parallel_for(
            (work.size() + piece_size - 1) / piece_size, band_.threads,
            [&](std::size_t piece) {
                View here = view();
                std::array<Vec3, SplineGrid::node_count> places;  // cubes of eight, one after another
                for (std::size_t w = piece * piece_size; w < std::min(work.size(), (piece + 1) * piece_size);
                     ++w) {
                    const auto [g, b] = work[w];
                    for (int k = 0; k < SplineGrid::node_count; ++k) {
                        const auto [x, y, z] = by_cubes(k);
                        places[k] = grids[g].place(b, x, y, z);
                    }
                    constexpr int half = SplineGrid::brick_side / 2;
                    here.look_from(g, grids[g].place(b, half, half, half));
                    here.distances(places, [&, g = g, b = b](std::size_t k, double distance) {
                        const auto [x, y, z] = by_cubes(static_cast<int>(k));
                        constexpr int n = SplineGrid::brick_side;
                        grids[g].nodes(b)[(x * n + y) * n + z] = static_cast<float>(rounded(distance));
                        return goes_on(here, g, b);
                    });
                }
            },
            part(from, to));
    }

    double rounded(double distance) const {
        return band_.step > 0 ? band_.step * std::floor(distance / band_.step + 0.5) : distance;
    }

    /// Takes the marked bricks out of a grid of values.
    static BrickList split_off(const std::vector<char>& marked, SplineGrid& grid) {
        BrickList off, kept;
        for (std::size_t b = 0; b < grid.bricks(); ++b) (marked[b] ? off : kept).push_back(grid.brick(b));
        SplineGrid rest(grid.spacing(), std::move(kept));
        for (std::size_t b = 0, r = 0; b < grid.bricks(); ++b)
            if (!marked[b]) std::ranges::copy(grid.nodes(b), rest.nodes(r++).begin());
        grid = std::move(rest);
        return off;
    }

    const LumenSurface& surface_;
    const CentrelineTree& tree_;
    const VesselSheets& sheets_;
    const FieldBand& band_;
    SeenSurface triangles_;
    const std::function<void(double)>& progress_;
    std::vector<StationRuns> runs_;  // per sheet
    std::vector<int> station_of_triangle_;
    std::vector<char> level_;  // per triangle, of the coarsest grid that is fine enough for its wall
};

}  // namespace

LumenSurface lumen_surface(const TriangleMesh& mesh, const CentrelineTree& tree) {
    const StationRuns runs(tree.stations(), all_of(tree.stations()));
    int seed = -1;
    const auto inward = [&](const Vec3& x) {
        seed = runs.deepest(x, seed);
        return tree.stations()[seed].centre;
    };
    LumenSurface surface(mesh, inward);
    const TriangleMesh even = with_even_rims(surface.mesh(), tree.ends());
    if (static_cast<int>(even.triangles.size()) == surface.count()) return surface;
    return LumenSurface(even, inward);
}

double band_section(double radius, double inner, double outer) {
    // A band that is deeper than the vessel fills it, and no more.
    if (inner < radius) return 2 * std::numbers::pi * radius * (inner + outer);
    return std::numbers::pi * (radius + outer) * (radius + outer);
}

void refuse_size(double spacing, double bytes, std::size_t largest) {
    throw std::invalid_argument("a distance field of spacing " + std::to_string(spacing) + " mm would take " +
                                std::to_string(std::llround(bytes / 1e6)) + " MB, more than the " +
                                std::to_string(largest / 1000000) +
                                " MB allowed: choose a wider spacing, and check the unit of the lumen");
}

std::vector<SheetField> sampled_values(const LumenSurface& surface, const CentrelineTree& tree,
                                       const VesselSheets& sheets, const FieldBand& band,
                                       const std::function<void(double)>& progress) {
    check_size(band_bricks(tree, band), band);
    return Sampler(surface, tree, sheets, band, progress).values();
}

void fit(std::vector<SheetField>& fields, int threads) {
    for (SheetField& field : fields)
        for (std::size_t level = field.grids.size(); level-- > 0;)
            field.grids[level].fit(threads,
                                   level + 1 < field.grids.size() ? &field.grids[level + 1] : nullptr);
}

std::vector<SheetField> sampled_fields(const LumenSurface& surface, const CentrelineTree& tree,
                                       const VesselSheets& sheets, const FieldBand& band,
                                       const std::function<void(double)>& progress) {
    std::vector<SheetField> fields = sampled_values(surface, tree, sheets, band, progress);
    fit(fields, band.threads);
    return fields;
}

}  // namespace physics
